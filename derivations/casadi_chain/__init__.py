"""The segment chain in CasADi: equations of motion from its energies.

Only energies, positions and directions are stated here; CasADi differentiates them. No derivative
is written by hand.

Energies (SI units, angles in radians)
--------------------------------------
Segment k points along e_k = (sin φ_k cos θ_k, sin φ_k sin θ_k, cos φ_k) from the node r_{k−1} to
r_k = r_{k−1} + h e_k; its centre is c_k = r_{k−1} + (h/2) e_k. The clamp is e_0 at r_0.

    E_kin    = Σ_k ½ m_k |ċ_k|² + ½ J_k |ė_k|²
    E_spring = Σ_k c_k S(u_k),   u_k = ½ |e_k − R(κ_k) e_{k−1}|²,   S(u) = ½ α²
    E_grav   = −Σ_k m_k g·c_k
    D        = Σ_k ½ d_k |ω_k − ω_{k−1}|²,   ω_k = e_k × (ė_k − Ω × e_k),   ω_0 = 0

Ω is the angular velocity of the brush body; the dampers see the filament from the body. R(κ) turns
a vector about z by κ. The spring of joint k is relaxed where e_k is e_{k−1} turned by κ_k.

Lagrange's equations, with the energies' dependence on time through the motion of the clamp:

    d/dt ∂E_kin/∂q̇ − ∂E_kin/∂q + ∂E_pot/∂q + ∂D/∂q̇ = 0   ⇔   M q̈ = f

The bending angle
-----------------
The chord of two unit vectors at the angle α is |e' − e| = 2 sin(α/2), hence

    S = ½ α² = 2 asin²(√(u/2)) = Σ_{k ≥ 1} 2^k u^k / (k² C(2k, k)),

from asin²(x) = ½ Σ (2x)^(2k) / (k² C(2k, k)). S is analytic in u at the straight joint u = 0, where
asin(√u) is not differentiable. The series therefore serves u < δ, and the closed form the rest. The
number `near` blends the two: 1 if u < δ and 0 elsewhere, which CasADi differentiates to zero. Where
`near` is 1, the closed form gets δ for u, so that it stays finite and drops out exactly. Its second
derivative loses digits by cancellation as 1/u; above δ it loses less than two.

The frame
---------
ṙ_0 leaves Lagrange's equations: they hold in every inertial frame (Galileo). The equations are
therefore taken in the frame in which the root, or the inner end of the segment, rests at the
moment: ṙ_0 is set to zero after all differentiation. Otherwise large terms would remain that differ
by roundings only. The energies depend on ṙ_0 and have it as an argument.

The body
--------
A segment that turns rigidly with the body has the rates q̇_r with (∂e/∂q) q̇_r = Ω × e. The
rates in the body, q̇ − q̇_r, give ė − Ω × e as the rate of e. As q̇_r does not depend on q̇, ∂D/∂q̇
is the derivative by them. The rates of the joints' kernels are therefore those in the body, and Ω
enters the kernel of q̇_r alone.

In the plane of rotation
------------------------
With φ_k = π/2, e_k = (cos θ_k, sin θ_k), ω_k = θ̇_k − Ω along z, and θ_k is the one coordinate of
a segment. Between two segments α = θ_{k+1} − θ_k − κ is known, so that E_spring = ½ c α². The clamp
is given by its direction alone, so that S(u) stays there.

The lateral variation is the motion that a small tilt τ of the clamp out of the plane causes:
φ_k = π/2 + η_k τ. Its equations are the derivatives of the spatial ones for φ along τ, with
φ = π/2 + ψ, and ψ = 0, ψ̇ = 0, ψ̈ = 0 after all differentiation.
"""

import os
import shlex
import sys
from pathlib import Path

# The version in requirements.txt; another one may order the operations otherwise.
CASADI_VERSION = "3.8.2"
REQUIREMENTS = Path(__file__).parents[1] / "requirements.txt"
INSTALL_COMMAND = (
    f"{shlex.quote(sys.executable)} -m pip install -r {shlex.quote(os.path.relpath(REQUIREMENTS))}"
)

try:
    import casadi
except ImportError:
    sys.exit(f"segment_chain.py needs CasADi, which is not installed: {INSTALL_COMMAND}")
if casadi.__version__ != CASADI_VERSION:
    sys.exit(
        f"segment_chain.py needs CasADi {CASADI_VERSION}, but {casadi.__version__} is installed: "
        f"{INSTALL_COMMAND}"
    )
