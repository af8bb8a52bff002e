"""Draws the normal force over the depth with and without friction, interaction and tilts.

It simulates `open_question.toml`, and the same brushes with tilted clamps (up to an hour). It writes
results to `open_question/` and `open_question/tilted/`, and the figure of docs/notes.md to
`open_question/friction_or_interaction.svg`:

    pip install "./python[notebooks]"
    python examples/open_question.py
"""

from pathlib import Path

import bristle
import numpy as np
from matplotlib.figure import Figure

OUT = Path("open_question")
# Rows of tilted filaments. They repeat along the axis and stand for all rows of the brush.
ROWS = 4
TILT_RAD = 5e-3


def tilted(settings: bristle.Settings) -> bristle.Settings:
    """Returns a slice of the brush, with a random tilt of each clamp out of its plane."""
    share = ROWS / settings.brush["rows"]
    return settings.replace(
        tool={
            "width_m": share * settings.tool["width_m"],
            "filament_count": round(share * settings.tool["filament_count"]),
        },
        brush={"rows": ROWS, "lateral_tilt_std_rad": TILT_RAD},
    )


def draw(runs, tilted_force) -> Figure:
    """Draws one panel per velocity, with a colour for each coefficient.

    Lines are solid in rows, dashed alone, dotted in rows with tilts. `tilted_force` has the normal
    force of the whole brush with tilts in N, one value per run.
    """
    velocity, depth = runs["brushing_velocity_m_s"], runs["penetration_depth_m"]
    friction = runs["contact.friction_coefficient"]
    in_rows = runs["tool_contact_normal_force_n"]
    alone = in_rows / runs["interaction_factor"]
    lines = ((in_rows, "-o"), (alone, "--s"), (tilted_force, ":^"))
    velocities = np.unique(velocity)
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    panels = figure.subplots(1, len(velocities), sharey=True)
    for panel, (axes, speed) in enumerate(zip(panels, velocities)):
        for number, coefficient in enumerate(np.unique(friction)):
            rows = (velocity == speed) & (friction == coefficient)
            for force, style in lines:
                is_first = panel == 0 and style == "-o"
                label = f"µ = {coefficient:g}" if is_first else None
                axes.plot(1e3 * depth[rows], force[rows], style, color=f"C{number}", ms=3, label=label)
        axes.set(title=f"{speed:g} m/s", xlabel="penetration depth in mm", xlim=(0, None), ylim=(0, None))
    panels[0].set_ylabel("normal force of the tool in N")
    figure.legend(loc="outside right center", title="— in rows\n- - alone\n··· with tilts")
    return figure


if __name__ == "__main__":
    settings = bristle.load(Path(__file__).with_suffix(".toml"))
    runs = bristle.study(settings, out=OUT).runs
    in_space = bristle.study(tilted(settings), out=OUT / "tilted").runs
    force = in_space["tool_contact_normal_force_n"] * settings.brush["rows"] / ROWS
    draw(runs, force).savefig(OUT / "friction_or_interaction.svg")
