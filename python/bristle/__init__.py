"""Contact forces of brushing tools.

>>> import bristle
>>> settings = bristle.Settings.paper(10.0, 1e-3)  # v_b in m/s, a_e in m
>>> contact = bristle.simulate(settings)
>>> f"{contact.metrics['tool_contact_normal_force_n']:.0f} N"
'165 N'

All quantities are in SI units, which are part of the names; angles are in radians.
Names are those of the input file (``docs/input.md``) and of the result files
(``docs/results.md``); ``docs/MODEL.md`` has the physics.

- Settings: `Settings`, `load`, `SettingsError`, `SettingsWarning`
- One contact of one filament: `simulate`, `Contact`, `Shapes`, `Metrics`,
  `ContactMetrics`, `Statistics`, `Table`, `Tool`, `SimulationError`, `ResultWarning`
- Filaments that touch each other: `brush`, `Brush`, `Frames`, `BrushMetrics`
- Many cases: `study`, `Study`, `Advice`, `PartialStudy`; on clusters, the module `bristle.distributed`
- Numbers of segments and tolerances that are enough: `converge`, `Convergence`
- Settings from measured forces, or from the radii of an edge: `calibrate`, `Calibration`
- Edges that grow round, and filaments that wear: `wear`, `Removal`
- Equations of motion: `accelerations`, `evaluate`, `Evaluation`, `derive`
"""

from bristle._bristle import __version__
from bristle._brush import Brush, Frames, brush
from bristle._calibration import Calibration, calibrate
from bristle._contact import Contact, Shapes, simulate
from bristle._convergence import Convergence, converge
from bristle._equations import (
    Evaluation,
    accelerations,
    derive,
    evaluate,
)
from bristle._errors import (
    ResultWarning,
    SettingsError,
    SettingsWarning,
    SimulationError,
)
from bristle._metrics import BrushMetrics, ContactMetrics, Metrics, Statistics
from bristle._removal import Removal, wear
from bristle._settings import Settings, load
from bristle._study import Advice, PartialStudy, Study, study
from bristle._table import Table
from bristle._tool import Tool

# In the order of the groups above, which is that of the API pages.
__all__ = [
    "Settings",
    "load",
    "SettingsError",
    "SettingsWarning",
    "simulate",
    "Contact",
    "Shapes",
    "Metrics",
    "ContactMetrics",
    "Statistics",
    "Table",
    "Tool",
    "SimulationError",
    "ResultWarning",
    "brush",
    "Brush",
    "Frames",
    "BrushMetrics",
    "study",
    "Study",
    "Advice",
    "PartialStudy",
    "converge",
    "Convergence",
    "calibrate",
    "Calibration",
    "wear",
    "Removal",
    "accelerations",
    "evaluate",
    "Evaluation",
    "derive",
    "__version__",
]
