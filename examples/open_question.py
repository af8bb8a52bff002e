"""Draws the normal force over the depth with and without friction and interaction.

It simulates `open_question.toml` (some minutes) and writes its results to `open_question/` and the
figure of docs/notes.md to `open_question/friction_or_interaction.svg`:

    pip install "./python[notebooks]"
    python examples/open_question.py
"""

from pathlib import Path

import bristle
import numpy as np
from matplotlib.figure import Figure

OUT = Path("open_question")


def draw(runs) -> Figure:
    """One panel per velocity: solid in rows, dashed alone, a colour for each coefficient."""
    velocity, depth = runs["brushing_velocity_m_s"], runs["penetration_depth_m"]
    friction = runs["contact.friction_coefficient"]
    in_rows = runs["tool_contact_normal_force_n"]
    alone = in_rows / runs["interaction_factor"]
    velocities = np.unique(velocity)
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    panels = figure.subplots(1, len(velocities), sharey=True)
    for panel, (axes, speed) in enumerate(zip(panels, velocities)):
        for number, coefficient in enumerate(np.unique(friction)):
            rows = (velocity == speed) & (friction == coefficient)
            for force, style in ((in_rows, "-o"), (alone, "--s")):
                is_first = panel == 0 and style == "-o"
                label = f"µ = {coefficient:g}" if is_first else None
                axes.plot(1e3 * depth[rows], force[rows], style, color=f"C{number}", ms=3, label=label)
        axes.set(title=f"{speed:g} m/s", xlabel="penetration depth in mm", xlim=(0, None), ylim=(0, None))
    panels[0].set_ylabel("normal force of the tool in N")
    figure.legend(loc="outside right center", title="— in rows\n- - alone")
    return figure


if __name__ == "__main__":
    settings = bristle.load(Path(__file__).with_suffix(".toml"))
    study = bristle.study(settings, out=OUT)
    draw(study.runs).savefig(OUT / "friction_or_interaction.svg")
