#include "scan_context/principal_axes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace scanloc {
namespace {

Eigen::VectorXd InMetres(std::span<const std::int32_t> key_cm) {
  const Eigen::Map<const Eigen::VectorXi> key(key_cm.data(),
                                              static_cast<Eigen::Index>(key_cm.size()));
  return key.cast<double>() * 0.01;
}

}  // namespace

PrincipalAxes::PrincipalAxes(const ContextTable& table, std::span<const std::size_t> entries) {
  const int num_rows = table.num_rows();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(num_rows);
  Eigen::MatrixXd second_moment = Eigen::MatrixXd::Zero(num_rows, num_rows);
  for (const std::size_t i : entries) {
    const Eigen::VectorXd key_m = InMetres(table.retrieval_key_cm(i));
    mean += key_m;
    second_moment.selfadjointView<Eigen::Lower>().rankUpdate(key_m);
  }
  const double count = std::max<double>(1.0, static_cast<double>(entries.size()));
  mean /= count;
  second_moment.triangularView<Eigen::Lower>() -= (count * mean * mean.transpose()).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(second_moment);
  axes_ = solver.eigenvectors().rowwise().reverse().transpose();
}

double PrincipalAxes::Turn(std::span<const std::int32_t> key_cm,
                           std::span<float> components) const {
  const auto size = static_cast<Eigen::Index>(components.size());
  const Eigen::VectorXd key = InMetres(key_cm);
  const Eigen::VectorXd turned = axes_.topRows(size) * key;
  Eigen::Map<Eigen::VectorXf>(components.data(), size) = turned.cast<float>();
  return key.norm();
}

}  // namespace scanloc
