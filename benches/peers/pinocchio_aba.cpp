// The time of Pinocchio's articulated-body algorithm at one state, without Python around it.
//
// Arguments: the joints (spherical, universal, or revolutes: two of them with a massless link), the number of segments,
// the length, mass, and inertias of one across and along its axis, effective gravity (3).
// In: on stdin, lines "calls q… v… tau…". Out: a line for each: seconds a call in either of the algorithm's conventions,
// then the joint accelerations. The algorithm is the compiled one of the package's library.

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>

using pinocchio::Convention;
using pinocchio::SE3;

template <class Vector> static bool read(Vector &&values) {
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (!(std::cin >> values[i])) return false;
  return true;
}

int main(int count, char **arguments) {
  if (count != 10) return 2;
  const std::string joints = arguments[1];
  const int segments = std::atoi(arguments[2]);
  double numbers[7];
  for (int i = 0; i < 7; ++i) numbers[i] = std::strtod(arguments[3 + i], nullptr);
  const double length = numbers[0], mass = numbers[1];

  pinocchio::Model model;
  model.gravity.linear() = Eigen::Vector3d(numbers[4], numbers[5], numbers[6]);
  const Eigen::Vector3d inertia(numbers[2], numbers[2], numbers[3]);
  const pinocchio::Inertia rod(mass, Eigen::Vector3d(0, 0, length / 2), Eigen::Matrix3d(inertia.asDiagonal()));
  pinocchio::JointIndex parent = 0;
  SE3 placement = SE3::Identity();
  for (int k = 0; k < segments; ++k) {
    const std::string name = std::to_string(k + 1);
    if (joints == "spherical") {
      parent = model.addJoint(parent, pinocchio::JointModelSpherical(), placement, "joint_" + name);
    } else if (joints == "universal") {
      const pinocchio::JointModelUniversal joint(Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
      parent = model.addJoint(parent, joint, placement, "joint_" + name);
    } else {
      parent = model.addJoint(parent, pinocchio::JointModelRX(), placement, "x_" + name);
      parent = model.addJoint(parent, pinocchio::JointModelRY(), SE3::Identity(), "y_" + name);
    }
    model.appendBodyToJoint(parent, rod, SE3::Identity());
    placement.translation() = Eigen::Vector3d(0, 0, length);
  }
  pinocchio::Data data(model);

  Eigen::VectorXd q(model.nq), v(model.nv), tau(model.nv);
  long calls;
  while ((std::cin >> calls) && read(q) && read(v) && read(tau)) {
    for (const Convention convention : {Convention::WORLD, Convention::LOCAL}) {
      const auto start = std::chrono::steady_clock::now();
      for (long call = 0; call < calls; ++call) pinocchio::aba(model, data, q, v, tau, convention);
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      std::printf("%.17g ", elapsed.count() / calls);
    }
    for (Eigen::Index i = 0; i < model.nv; ++i) std::printf(" %.17g", data.ddq[i]);
    std::printf("\n");
    std::fflush(stdout);
  }
}
