"""A continuous beam in Exudyn: the cable of absolute nodal coordinates, ObjectANCFCable2D.

Each node has its position and the slope vector as coordinates, each element a cubic; there are no
angles, no joints and no constraints between elements. The beam bends and stretches but does not
shear, and its cross-section has no rotary inertia: with a large axial stiffness it is what the
chain becomes for n → ∞. It is clamped to a hub on the axis whose angle is prescribed. The spin-up
is also solved by another kind of element, ObjectBeamGeometricallyExact2D.

Steps are equal (generalised-α, index 3). A penalty contact switches in discontinuous iterations.
Residuals of Newton's method are forces in N; rounding leaves some 1e-16 of the axial stiffness
times a few thousand, so the tolerance is told by the caller.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import exudyn
import numpy as np
from exudyn.itemInterface import (
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    NodeGenericData,
    NodePoint2DSlope1,
    NodePointGround,
    NodeRigidBody2D,
    ObjectANCFCable2D,
    ObjectBeamGeometricallyExact2D,
    ObjectConnectorCoordinate,
    ObjectContactCoordinate,
    ObjectJointGeneric,
    ObjectRigidBody2D,
    SensorNode,
)
from paper_case import (
    AREA_M2,
    BENDING_STIFFNESS_N_M2,
    BODY_RADIUS_M,
    CONTACT_STIFFNESS_N_M,
    DAMPING_RATIO,
    DENSITY_KG_M3,
    FIRST_FREQUENCY_RAD_S,
    LENGTH_M,
    YOUNGS_MODULUS_PA,
    Case,
    Pass,
)
from pass_motion import PassMotion

OfTime = Callable[[float], float]

SPECTRAL_RADIUS = 0.9
DISCONTINUOUS_TOLERANCE = 1e-2
# Of the hub, in kg and kg m²; its motion is prescribed, so only rounding depends on it.
HUB_INERTIA = 1e-6
# Gap that the contact starts with, in m: open.
OPEN_GAP_M = 1e-3


@dataclass(frozen=True)
class Beam:
    """A uniform beam, in SI units."""

    length_m: float
    mass_per_length_kg_m: float
    bending_stiffness_n_m2: float
    axial_stiffness_n: float
    bending_damping_n_m2_s: float = 0.0


@dataclass(frozen=True)
class Settings:
    """Elements, equal steps, and the tolerance of Newton's method in N."""

    elements: int
    steps: int
    tolerance_n: float


class Cable:
    """A straight beam on a turning hub."""

    def __init__(
        self,
        beam: Beam,
        elements: int,
        root_radius_m: float,
        start_angle_rad: float,
        turned_rad: OfTime,
        rate_rad_s: OfTime,
    ) -> None:
        """The hub turns by turned_rad(t); at first the beam turns rigidly with it."""
        self._container = exudyn.SystemContainer()
        self._system = system = self._container.AddSystem()
        self._sensors: list[int] = []
        cosine, sine, rate = math.cos(start_angle_rad), math.sin(start_angle_rad), rate_rad_s(0.0)
        h = beam.length_m / elements
        radii = [root_radius_m + k * h for k in range(elements + 1)]
        self._heights_m = [radius * sine for radius in radii]
        self._nodes = [
            system.AddNode(
                NodePoint2DSlope1(
                    referenceCoordinates=[radius * cosine, radius * sine, cosine, sine],
                    initialVelocities=[
                        *(-rate * radius * sine, rate * radius * cosine),
                        *(-rate * sine, rate * cosine),
                    ],
                )
            )
            for radius in radii
        ]
        cables = [
            system.AddObject(
                ObjectANCFCable2D(
                    length=h,
                    massPerLength=beam.mass_per_length_kg_m,
                    bendingStiffness=beam.bending_stiffness_n_m2,
                    axialStiffness=beam.axial_stiffness_n,
                    bendingDamping=beam.bending_damping_n_m2_s,
                    nodeNumbers=[self._nodes[k], self._nodes[k + 1]],
                )
            )
            for k in range(elements)
        ]
        hub_node = system.AddNode(
            NodeRigidBody2D(
                referenceCoordinates=[0, 0, start_angle_rad], initialVelocities=[0, 0, rate]
            )
        )
        hub = system.AddObject(
            ObjectRigidBody2D(mass=HUB_INERTIA, inertia=HUB_INERTIA, nodeNumber=hub_node)
        )
        self._ground = place(system, hub_node, turned_rad, rate_rad_s)
        # Position and direction at the root; the strain there is free.
        clamp = [
            system.AddMarker(MarkerBodyRigid(bodyNumber=hub, localPosition=[root_radius_m, 0, 0])),
            system.AddMarker(MarkerBodyRigid(bodyNumber=cables[0], localPosition=[0, 0, 0])),
        ]
        system.AddObject(
            ObjectJointGeneric(markerNumbers=clamp, constrainedAxes=[1, 1, 0, 0, 0, 1])
        )

    def touch(self, node: int, stiffness_n_m: float, plane_m: float) -> None:
        """A penalty contact of a node, k_c δ, with a plane at this y."""
        node_height = coordinate_marker(self._system, self._nodes[node], 1)
        state = self._system.AddNode(
            NodeGenericData(numberOfDataCoordinates=1, initialCoordinates=[OPEN_GAP_M])
        )
        self._system.AddObject(
            ObjectContactCoordinate(
                markerNumbers=[self._ground, node_height],
                nodeNumber=state,
                contactStiffness=stiffness_n_m,
                # Coordinates are displacements.
                offset=plane_m - self._heights_m[node],
            )
        )

    def watch(self, node: int) -> None:
        """The position of this node is part of the result."""
        self._sensors.append(position_sensor(self._system, self._nodes[node]))

    def run(self, settings: Settings, end_s: float, every: int) -> list[np.ndarray]:
        """Positions of the watched nodes, as solved() tells."""
        return solved(self._system, self._sensors, settings, end_s, every)


def coordinate_marker(system: "exudyn.MainSystem", node: int, coordinate: int) -> int:
    """A marker on a coordinate of a node."""
    return system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))


def place(system: "exudyn.MainSystem", node: int, turned_rad: OfTime, rate_rad_s: OfTime) -> int:
    """Fixes x and y of a node and prescribes its angle; returns a marker on the ground."""
    ground = coordinate_marker(system, system.AddNode(NodePointGround()), 0)
    for coordinate in range(2):
        held = [ground, coordinate_marker(system, node, coordinate)]
        system.AddObject(ObjectConnectorCoordinate(markerNumbers=held))
    system.AddObject(
        ObjectConnectorCoordinate(
            markerNumbers=[ground, coordinate_marker(system, node, 2)],
            offsetUserFunction=lambda _system, time, _item, _offset: turned_rad(time),
            offsetUserFunction_t=lambda _system, time, _item, _offset: rate_rad_s(time),
        )
    )
    return ground


def position_sensor(system: "exudyn.MainSystem", node: int) -> int:
    """A sensor that keeps the positions of a node."""
    return system.AddSensor(
        SensorNode(
            nodeNumber=node,
            outputVariableType=exudyn.OutputVariableType.Position,
            storeInternal=True,
            writeToFile=False,
        )
    )


def solver_options(end_s: float, steps: int, write_period_s: float) -> exudyn.SimulationSettings:
    """Of the generalised-α method, quiet, with sensors that keep values once a period."""
    options = exudyn.SimulationSettings()
    options.solution.file.write = False
    options.solution.sensors.writePeriod = write_period_s
    options.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    integration = options.timeIntegration
    integration.verboseMode = 0
    integration.endTime = end_s
    integration.numberOfSteps = steps
    integration.generalizedAlpha.spectralRadius = SPECTRAL_RADIUS
    integration.discontinuous.iterationTolerance = DISCONTINUOUS_TOLERANCE
    return options


def solved(
    system: "exudyn.MainSystem", sensors: list[int], settings: Settings, end_s: float, every: int
) -> list[np.ndarray]:
    """Positions x and y by these sensors, from t = 0 to the end, at every so many steps."""
    step_s = end_s / settings.steps
    options = solver_options(end_s, settings.steps, every * step_s)
    # Equal steps or none: where Newton's method does not converge, this stops.
    options.timeIntegration.adaptiveStep = False
    options.timeIntegration.newton.absoluteTolerance = settings.tolerance_n
    system.Assemble()
    system.SolveDynamic(options, exudyn.DynamicSolverType.GeneralizedAlpha)
    positions, times = [], np.linspace(0.0, end_s, settings.steps // every + 1)
    for sensor in sensors:
        values = system.GetSensorStoredData(sensor)
        if len(values) != len(times) or np.max(np.abs(values[:, 0] - times)) > 1e-3 * step_s:
            raise RuntimeError(f"{settings}: not the steps that were asked for")
        positions.append(values[:, 1:3])
    return positions


def filament(axial_factor: float) -> Beam:
    """The paper's, with so many times its axial stiffness; damped as the chain's joints are."""
    return Beam(
        length_m=LENGTH_M,
        mass_per_length_kg_m=DENSITY_KG_M3 * AREA_M2,
        bending_stiffness_n_m2=BENDING_STIFFNESS_N_M2,
        axial_stiffness_n=axial_factor * YOUNGS_MODULUS_PA * AREA_M2,
        bending_damping_n_m2_s=2 * DAMPING_RATIO / FIRST_FREQUENCY_RAD_S * BENDING_STIFFNESS_N_M2,
    )


def contact_pass(case: Case, settings: Settings, axial_factor: float) -> tuple[PassMotion, float]:
    """One pass, and the smallest gap of the node beside the tip in m: the tip alone has contact."""
    of = Pass(case)
    cable = Cable(
        filament(axial_factor),
        settings.elements,
        BODY_RADIUS_M,
        of.start_angle_rad,
        lambda time: of.rate_rad_s * time,
        lambda _: of.rate_rad_s,
    )
    cable.touch(settings.elements, CONTACT_STIFFNESS_N_M, of.height_m)
    for node in (settings.elements, settings.elements - 1):
        cable.watch(node)
    tips, others = cable.run(settings, of.end_s, every=1)
    gaps = tips[:, 1] - of.height_m
    forces = CONTACT_STIFFNESS_N_M * np.maximum(0.0, -gaps)
    motion = PassMotion(of, of.end_s / settings.steps, tips, forces, gaps)
    return motion, float(np.min(others[:, 1]) - of.height_m)


# The spin-up of Simo and Vu-Quoc (1986), part II: clamped at the axis, at rest at first.
SPIN_UP_END_S = 20.0
SPIN_UP_TIME_S = 15.0
SPIN_UP_RATE_RAD_S = 6.0
SPIN_UP_AXIAL_STIFFNESS_N = 2.8e7


def spin_up_beam(axial_factor: float) -> Beam:
    """Theirs, with so many times its axial stiffness, and without rotary inertia."""
    return Beam(
        length_m=10.0,
        mass_per_length_kg_m=1.2,
        bending_stiffness_n_m2=1.4e4,
        axial_stiffness_n=axial_factor * SPIN_UP_AXIAL_STIFFNESS_N,
    )


def spin_up_angle_rad(time: float) -> float:
    """ψ(t)."""
    if time >= SPIN_UP_TIME_S:
        return SPIN_UP_RATE_RAD_S * (time - SPIN_UP_TIME_S / 2)
    wave = 2 * math.pi / SPIN_UP_TIME_S
    return (
        SPIN_UP_RATE_RAD_S / SPIN_UP_TIME_S * (time**2 / 2 + (math.cos(wave * time) - 1) / wave**2)
    )


def spin_up_rate_rad_s(time: float) -> float:
    """ψ̇(t)."""
    if time >= SPIN_UP_TIME_S:
        return SPIN_UP_RATE_RAD_S
    wave = 2 * math.pi / SPIN_UP_TIME_S
    return SPIN_UP_RATE_RAD_S / SPIN_UP_TIME_S * (time - math.sin(wave * time) / wave)


def spin_up(settings: Settings, axial_factor: float, rows: int) -> np.ndarray:
    """Times in s, and the tip's displacement along the clamp direction and across it in m."""
    beam = spin_up_beam(axial_factor)
    cable = Cable(beam, settings.elements, 0.0, 0.0, spin_up_angle_rad, spin_up_rate_rad_s)
    cable.watch(settings.elements)
    (tips,) = cable.run(settings, SPIN_UP_END_S, every=settings.steps // (rows - 1))
    return displacements(beam, tips)


def exact_spin_up(settings: Settings, axial_factor: float, rows: int) -> np.ndarray:
    """The same by geometrically exact elements of three nodes, with x, y and an angle.

    They shear, too; their shear stiffness is the axial one.
    """
    beam = spin_up_beam(axial_factor)
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    h = beam.length_m / settings.elements
    nodes = [
        system.AddNode(NodeRigidBody2D(referenceCoordinates=[h / 2 * k, 0, 0]))
        for k in range(2 * settings.elements + 1)
    ]
    for k in range(settings.elements):
        system.AddObject(
            ObjectBeamGeometricallyExact2D(
                nodeNumbers=nodes[2 * k : 2 * k + 3],
                length=h,
                massPerLength=beam.mass_per_length_kg_m,
                crossSectionInertia=0.0,
                bendingStiffness=beam.bending_stiffness_n_m2,
                axialStiffness=beam.axial_stiffness_n,
                shearStiffness=beam.axial_stiffness_n,
            )
        )
    place(system, nodes[0], spin_up_angle_rad, spin_up_rate_rad_s)
    tip = position_sensor(system, nodes[-1])
    (tips,) = solved(system, [tip], settings, SPIN_UP_END_S, settings.steps // (rows - 1))
    return displacements(beam, tips)


def displacements(beam: Beam, tips: np.ndarray) -> np.ndarray:
    """Times in s, and the displacement in m: along the clamp direction, across it."""
    times = np.linspace(0.0, SPIN_UP_END_S, len(tips))
    angles = np.array([spin_up_angle_rad(time) for time in times])
    cosines, sines = np.cos(angles), np.sin(angles)
    along = tips[:, 0] * cosines + tips[:, 1] * sines - beam.length_m
    across = tips[:, 1] * cosines - tips[:, 0] * sines
    return np.stack([times, along, across], axis=1)


def quiet() -> None:
    """Nothing to the standard output."""
    exudyn.config.printToConsole = False
