// The time of Pinocchio's articulated-body algorithm at one state, without Python around it.
//
// In: on stdin, the number of segments, the length, mass and transverse moment of inertia of one, effective gravity
// (3), and then lines "calls q… v… tau…". Out: a line for each: seconds a call, then the joint accelerations.
// The chain is that of derivations/reference_aba.py. The algorithm is the compiled one of the package's library.

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>

#include <chrono>
#include <cstdio>
#include <iostream>

using pinocchio::SE3;

template <class Vector> static bool read(Vector &&values) {
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (!(std::cin >> values[i])) return false;
  return true;
}

int main() {
  int segments;
  Eigen::Vector3d constants, gravity;
  if (!(std::cin >> segments) || !read(constants) || !read(gravity)) return 2;
  const double length = constants[0], mass = constants[1], inertia = constants[2];

  pinocchio::Model model;
  model.gravity.linear() = gravity;
  const pinocchio::Inertia rod(mass, Eigen::Vector3d(0, 0, length / 2), inertia * Eigen::Matrix3d::Identity());
  pinocchio::JointIndex parent = 0;
  SE3 placement = SE3::Identity();
  for (int k = 0; k < segments; ++k) {
    parent = model.addJoint(parent, pinocchio::JointModelSpherical(), placement, "joint_" + std::to_string(k + 1));
    model.appendBodyToJoint(parent, rod, SE3::Identity());
    placement.translation() = Eigen::Vector3d(0, 0, length);
  }
  pinocchio::Data data(model);

  Eigen::VectorXd q(model.nq), v(model.nv), tau(model.nv);
  long calls;
  while ((std::cin >> calls) && read(q) && read(v) && read(tau)) {
    const auto start = std::chrono::steady_clock::now();
    for (long call = 0; call < calls; ++call)
      pinocchio::aba(model, data, q, v, tau, pinocchio::Convention::WORLD);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    double local = 0;
    {
      const auto begin = std::chrono::steady_clock::now();
      for (long call = 0; call < calls; ++call)
        pinocchio::aba(model, data, q, v, tau, pinocchio::Convention::LOCAL);
      local = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    }
    std::printf("%.17g %.17g", elapsed.count() / calls, local / calls);
    for (Eigen::Index i = 0; i < model.nv; ++i) std::printf(" %.17g", data.ddq[i]);
    std::printf("\n");
    std::fflush(stdout);
  }
}
