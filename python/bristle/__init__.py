"""Contact forces of brushing tools.

>>> import bristle
>>> settings = bristle.Settings.paper(brushing_velocity_m_s=10.0, penetration_depth_m=1e-3)
>>> contact = bristle.simulate(settings)
>>> f"{contact.metrics['tool_contact_normal_force_n']:.0f} N"
'165 N'

All quantities are in SI units, which are part of the names; angles are in radians.
"""

from bristle._bristle import __version__
from bristle._brush import Brush, Frames, brush
from bristle._contact import Contact, Shapes, simulate
from bristle._equations import (
    Evaluation,
    Validation,
    accelerations,
    derive,
    evaluate,
    validate,
)
from bristle._errors import SettingsError, SettingsWarning, SimulationError
from bristle._metrics import BrushMetrics, Metrics, Statistics
from bristle._settings import Settings, load
from bristle._study import Advice, Study, study
from bristle._table import Table
from bristle._tool import Tool

__all__ = [
    "Advice",
    "Brush",
    "BrushMetrics",
    "Contact",
    "Evaluation",
    "Frames",
    "Metrics",
    "Settings",
    "SettingsError",
    "SettingsWarning",
    "Shapes",
    "SimulationError",
    "Statistics",
    "Study",
    "Table",
    "Tool",
    "Validation",
    "__version__",
    "accelerations",
    "brush",
    "derive",
    "evaluate",
    "load",
    "simulate",
    "study",
    "validate",
]
