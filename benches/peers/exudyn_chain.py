"""One contact in Exudyn: rigid bodies in the plane, its generalised-α method of index 3.

The segments are rigid bodies of three coordinates each, held together by revolute joints (Lagrange
multipliers), with spring-dampers between their angles. Each node is the centre of a sphere that
meets a triangle, the workpiece, which lies deeper by the radius: Exudyn's own penalty contact,
k_c δ. Its switching is found by discontinuous iterations, and steps are refined around it; at the
default tolerance of these p_n is of first order in the step, at a hundredth of it much better.

The clamp turns with a body of 1000 kg m², which the filament cannot slow down.
"""

import math
import time

import exudyn
import numpy as np
from exudyn.itemInterface import (
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodeGenericData,
    NodeRigidBody2D,
    ObjectConnectorCoordinateSpringDamper,
    ObjectContactSphereTriangle,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
    SensorObject,
)
from exudyn_cable import coordinate_marker, solver_options
from paper_case import BODY_RADIUS_M, CONTACT_STIFFNESS_N_M, SEGMENTS, Case, Chain, Pass

SPHERE_RADIUS_M = 0.01
# Half the width of the triangle.
REACH_M = 1.0


class Contact:
    """One pass at a nominal step."""

    def __init__(self, case: Case, step_s: float) -> None:
        self._pass, self._step_s = Pass(case), step_s

    def run(self) -> tuple[float, float]:
        """Seconds, and p_n in N s; the time is that of the solver, without building the model."""
        container = exudyn.SystemContainer()
        system, sensors = self._system(container)
        end_s, step_s = self._pass.end_s, self._step_s
        settings = solver_options(end_s, round(end_s / step_s), 0.01 * step_s)
        start = time.perf_counter()
        try:
            system.SolveDynamic(settings, exudyn.DynamicSolverType.GeneralizedAlpha)
        except (RuntimeError, ValueError):
            return math.nan, math.nan
        seconds = time.perf_counter() - start
        impulse = 0.0
        for sensor in sensors:
            values = system.GetSensorStoredData(sensor)
            impulse += np.trapezoid(np.linalg.norm(values[:, 1:], axis=1), values[:, 0])
        return seconds, float(impulse)

    def _system(self, container: exudyn.SystemContainer) -> tuple["exudyn.MainSystem", list[int]]:
        """The model and the sensors of the contact forces."""
        chain = Chain(SEGMENTS)
        h, angle, rate = chain.length_m, self._pass.start_angle_rad, self._pass.rate_rad_s
        system = container.AddSystem()

        def body(radius: float, mass: float, inertia: float) -> tuple[int, int]:
            """Node and object of a body with its centre so far from the axis."""
            x, y = radius * math.cos(angle), radius * math.sin(angle)
            node = system.AddNode(
                NodeRigidBody2D(
                    referenceCoordinates=[x, y, angle],
                    initialVelocities=[-rate * y, rate * x, rate],
                )
            )
            rigid = ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node)
            return node, system.AddObject(rigid)

        def point(of: int, along: float) -> int:
            """A point on the axis of a body."""
            return system.AddMarker(
                MarkerBodyPosition(bodyNumber=of, localPosition=[along, 0.0, 0.0])
            )

        ground = system.AddObject(ObjectGround())
        workpiece = system.AddMarker(MarkerBodyRigid(bodyNumber=ground))
        depth = self._pass.height_m - SPHERE_RADIUS_M
        corners = [[REACH_M, depth, -REACH_M], [-REACH_M, depth, -REACH_M], [0, depth, 2 * REACH_M]]
        inner_node, inner = body(0.0, 1e3, 1e3)
        system.AddObject(ObjectJointRevolute2D(markerNumbers=[point(ground, 0), point(inner, 0)]))
        outer_end, sensors = BODY_RADIUS_M, []
        for k in range(SEGMENTS):
            centre = BODY_RADIUS_M + h * (k + 0.5)
            node, segment = body(centre, chain.mass_kg, chain.inertia_kg_m2)
            system.AddObject(
                ObjectJointRevolute2D(
                    markerNumbers=[point(inner, outer_end), point(segment, -h / 2)]
                )
            )
            system.AddObject(
                ObjectConnectorCoordinateSpringDamper(
                    # Their angles.
                    markerNumbers=[coordinate_marker(system, of, 2) for of in (inner_node, node)],
                    stiffness=chain.stiffness_n_m[k],
                    damping=chain.damping_n_m_s[k],
                )
            )
            tip = system.AddMarker(
                MarkerBodyRigid(bodyNumber=segment, localPosition=[h / 2, 0.0, 0.0])
            )
            state = system.AddNode(
                NodeGenericData(numberOfDataCoordinates=4, initialCoordinates=[1e-3, 0, 0, 0])
            )
            contact = system.AddObject(
                ObjectContactSphereTriangle(
                    markerNumbers=[tip, workpiece],
                    nodeNumber=state,
                    sphereRadius=SPHERE_RADIUS_M,
                    trianglePoints=exudyn.Vector3DList(corners),
                    includeEdges=0,
                    contactStiffness=CONTACT_STIFFNESS_N_M,
                    contactDamping=0.0,
                    impactModel=0,
                )
            )
            sensors.append(
                system.AddSensor(
                    SensorObject(
                        objectNumber=contact,
                        outputVariableType=exudyn.OutputVariableType.Force,
                        storeInternal=True,
                        writeToFile=False,
                    )
                )
            )
            inner_node, inner, outer_end = node, segment, h / 2
        system.Assemble()
        return system, sensors


def quiet() -> None:
    """Steps that are too large are tried too; what comes of them is seen in p_n."""
    exudyn.config.printToConsole = False
