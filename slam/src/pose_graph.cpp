#include "scanloc/slam/pose_graph.hpp"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "graph_errors.hpp"
#include "scanloc/core/median.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::slam {
namespace {

constexpr int kDriftSize = 6;
/// Wrong constraints are told from right ones with an odometry that may err by so many times what
/// was said ...
constexpr double kLooseFactor = 4.0;
/// ... and then by as much as it was found to err, within these: less is not believed, since loops
/// of one street are alike and tell less than they seem to.
constexpr double kLeastFactor = 1.0;
constexpr double kMostFactor = 50.0;
constexpr double kMinToLearn = 20.0;  // constraints that hold: with fewer, what was said stands
constexpr int kNoiseRounds = 3;
constexpr double kGrowth = 2.5;  // of the convexity's control, from round to round
/// Constraints so much farther off than most are wrong.
constexpr double kBeyondMedian = 25.0;
constexpr int kMaxRounds = 120;
constexpr int kMaxSettling = 10;
constexpr int kIterationsOfRound = 5;
constexpr int kIterationsAtEnd = 100;

/// One pose as the solver has it.
struct Node {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d position;
};

class Solver {
 public:
  Solver(const PoseGraph& graph, const GraphOptions& options)
      : graph_(graph),
        options_(options),
        origin_(graph.T_map_scan.front().translation()),
        roots_(graph.constraints.size()),
        weights_(graph.constraints.size(), 1.0),
        chi2_(graph.constraints.size(), 0.0),
        noise_(options.noise) {
    // Near the origin: what the solver calls a small change is in proportion to coordinates.
    for (const Pose& pose : graph.T_map_scan) {
      nodes_.push_back({Eigen::Quaterniond(pose.linear()), pose.translation() - origin_});
    }
    constraints_ = graph.constraints;
    for (Constraint& constraint : constraints_) {
      if (!constraint.from) constraint.T_from_to.translation() -= origin_;
    }
  }

  absl::Status FindRoots() {
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      const Eigen::LLT<Matrix6> llt(constraints_[i].information);
      if (llt.info() != Eigen::Success || !constraints_[i].information.allFinite()) {
        return absl::InvalidArgumentError(
            absl::StrCat("the information of constraint ", i, " is not positive definite"));
      }
      roots_[i] = llt.matrixU();
    }
    return absl::OkStatus();
  }

  absl::StatusOr<OptimizedGraph> Run() {
    if (constraints_.empty()) return Result();  // odometry agrees with itself
    noise_ = options_.noise.Times(kLooseFactor, kLooseFactor);
    RETURN_IF_ERROR(Graduate());
    for (int round = 0; round < kNoiseRounds; ++round) {
      FindNoise();
      RETURN_IF_ERROR(Settle());
    }
    return Result();
  }

 private:
  /// Graduated non-convexity, from where the nodes are, to truncated least squares.
  absl::Status Graduate() {
    Build();
    // What is trusted tells some of the drift before anything else is believed.
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      weights_[i] = constraints_[i].is_trusted ? 1.0 : 0.0;
    }
    RETURN_IF_ERROR(Solve(kIterationsAtEnd, 1e-8));
    MeasureConstraints();
    // Where odometry puts the scans, most constraints are off by its drift, and wrong ones by far
    // more: those do not get to bend the graph in the first place.
    std::vector<double> chi2;
    for (std::size_t i = 0; i < chi2_.size(); ++i) {
      if (!constraints_[i].is_trusted) chi2.push_back(chi2_[i]);
    }
    if (chi2.empty()) return absl::OkStatus();
    const double farthest =
        std::max(kBeyondMedian * Median(std::move(chi2)), 2.0 * options_.max_chi2);
    double mu = options_.max_chi2 / (farthest - options_.max_chi2);
    for (int round = 0; round < kMaxRounds; ++round, mu *= kGrowth) {
      if (!Reweigh(mu)) break;
      RETURN_IF_ERROR(Solve(kIterationsOfRound, 1e-5));
      MeasureConstraints();
    }
    SwitchHard();
    return Solve(kIterationsAtEnd, 1e-8);
  }

  /// With the noise that was found: what is off may hold now, and what is on may not.
  absl::Status Settle() {
    Build();
    for (int round = 0; round < kMaxSettling; ++round) {
      RETURN_IF_ERROR(Solve(kIterationsAtEnd, 1e-10));
      MeasureConstraints();
      if (!SwitchHard()) break;
    }
    return absl::OkStatus();
  }

  /// Whether any constraint was switched.
  bool SwitchHard() {
    bool is_changed = false;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const bool is_on = constraints_[i].is_trusted || chi2_[i] <= options_.max_chi2;
      const double weight = is_on ? 1.0 : 0.0;
      is_changed = is_changed || weight != weights_[i];
      weights_[i] = weight;
    }
    return is_changed;
  }

  /// Whether any constraint is still between on and off.
  bool Reweigh(double mu) {
    const double low = mu / (mu + 1.0) * options_.max_chi2;
    const double high = (mu + 1.0) / mu * options_.max_chi2;
    bool is_open = false;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      if (constraints_[i].is_trusted || chi2_[i] <= low) {
        weights_[i] = 1.0;
      } else if (chi2_[i] >= high) {
        weights_[i] = 0.0;
      } else {
        weights_[i] = std::sqrt(options_.max_chi2 * mu * (mu + 1.0) / chi2_[i]) - mu;
        is_open = true;
      }
    }
    return is_open || mu < 1.0;
  }

  void Build() {
    ceres::Problem::Options problem_options;
    problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    problem_ = std::make_unique<ceres::Problem>(problem_options);
    for (Node& node : nodes_) {
      problem_->AddParameterBlock(node.rotation.coeffs().data(), 4, &manifold_);
      problem_->AddParameterBlock(node.position.data(), 3);
    }
    for (std::size_t i = 1; i < nodes_.size(); ++i) AddStep(i);
    problem_->AddResidualBlock(
        new ceres::AutoDiffCostFunction<DriftError, 6, kDriftSize>(new DriftError(options_.noise)),
        nullptr, drift_.data());
    bool is_tied = false;
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      AddConstraint(i);
      is_tied = is_tied || !constraints_[i].from;
    }
    if (is_tied) return;
    problem_->SetParameterBlockConstant(nodes_.front().rotation.coeffs().data());
    problem_->SetParameterBlockConstant(nodes_.front().position.data());
  }

  StepError MakeStep(std::size_t i) const {
    const Pose step = graph_.T_odom_scan[i - 1].inverse() * graph_.T_odom_scan[i];
    const auto [sigma_m, sigma_rad] = SigmasOfStep(step, noise_);
    return {step, sigma_m, sigma_rad};
  }

  void AddStep(std::size_t i) {
    Node& a = nodes_[i - 1];
    Node& b = nodes_[i];
    problem_->AddResidualBlock(
        new ceres::AutoDiffCostFunction<StepError, 6, 4, 3, 4, 3, kDriftSize>(
            new StepError(MakeStep(i))),
        nullptr, a.rotation.coeffs().data(), a.position.data(), b.rotation.coeffs().data(),
        b.position.data(), drift_.data());
  }

  void AddConstraint(std::size_t i) {
    const Constraint& constraint = constraints_[i];
    auto* error = new ConstraintError(constraint, roots_[i], &weights_[i]);
    Node& to = nodes_[constraint.to];
    if (!constraint.from) {
      problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<ConstraintError, 6, 4, 3>(error),
                                 nullptr, to.rotation.coeffs().data(), to.position.data());
      return;
    }
    Node& from = nodes_[*constraint.from];
    problem_->AddResidualBlock(
        new ceres::AutoDiffCostFunction<ConstraintError, 6, 4, 3, 4, 3>(error), nullptr,
        from.rotation.coeffs().data(), from.position.data(), to.rotation.coeffs().data(),
        to.position.data());
  }

  absl::Status Solve(int max_iterations, double tolerance) {
    if (options_.is_cancelled && options_.is_cancelled()) {
      return absl::CancelledError("interrupted while the pose graph was optimised");
    }
    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    solver.max_num_iterations = max_iterations;
    solver.function_tolerance = tolerance;
    solver.num_threads = 1;  // sums in one order: the same poses again
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, problem_.get(), &summary);
    num_iterations_ += static_cast<int>(summary.iterations.size());
    if (summary.IsSolutionUsable()) return absl::OkStatus();
    return absl::InternalError(
        absl::StrCat("the pose graph cannot be optimised: ", summary.message));
  }

  void MeasureConstraints() {
    const double on = 1.0;
    for (std::size_t i = 0; i < constraints_.size(); ++i) {
      const ConstraintError error(constraints_[i], roots_[i], &on);
      Eigen::Matrix<double, 6, 1> residual;
      const Node& to = nodes_[constraints_[i].to];
      if (constraints_[i].from) {
        const Node& from = nodes_[*constraints_[i].from];
        error(from.rotation.coeffs().data(), from.position.data(), to.rotation.coeffs().data(),
              to.position.data(), residual.data());
      } else {
        error(to.rotation.coeffs().data(), to.position.data(), residual.data());
      }
      chi2_[i] = residual.squaredNorm();
    }
  }

  /// By how much the odometry errs: what is on ties six numbers each, as far as it is more than a
  /// few, and what odometry had to give way by follows from its noise.
  void FindNoise() {
    const auto num_on =
        static_cast<double>(std::ranges::count_if(weights_, [](double w) { return w > 0.5; }));
    Eigen::Vector2d chi2 = Eigen::Vector2d::Zero();
    for (std::size_t i = 1; i < nodes_.size(); ++i) {
      Eigen::Matrix<double, 6, 1> residual;
      MakeStep(i)(nodes_[i - 1].rotation.coeffs().data(), nodes_[i - 1].position.data(),
                  nodes_[i].rotation.coeffs().data(), nodes_[i].position.data(), drift_.data(),
                  residual.data());
      chi2 += Eigen::Vector2d(residual.head<3>().squaredNorm(), residual.tail<3>().squaredNorm());
    }
    if (num_on < kMinToLearn) {
      noise_ = options_.noise;
      return;
    }
    const OdometryNoise found =
        noise_.Times(std::sqrt(chi2.x() / (3.0 * num_on)), std::sqrt(chi2.y() / (3.0 * num_on)));
    const OdometryNoise& given = options_.noise;
    noise_ = given.Times(std::clamp(found.step_m / given.step_m, kLeastFactor, kMostFactor),
                         std::clamp(found.step_rad / given.step_rad, kLeastFactor, kMostFactor));
  }

  OptimizedGraph Result() const {
    OptimizedGraph result;
    for (const Node& node : nodes_) {
      Pose pose = Pose::Identity();
      pose.linear() = node.rotation.normalized().toRotationMatrix();
      pose.translation() = node.position + origin_;
      result.T_map_scan.push_back(pose);
    }
    result.chi2 = chi2_;
    for (const double weight : weights_) result.is_on.push_back(weight > 0.5);
    result.drift.shift_m_m = Eigen::Map<const Eigen::Vector3d>(drift_.data());
    result.drift.turn_rad_m = Eigen::Map<const Eigen::Vector3d>(drift_.data() + 3);
    result.noise = noise_;
    result.num_iterations = num_iterations_;
    return result;
  }

  const PoseGraph& graph_;
  const GraphOptions& options_;
  const Eigen::Vector3d origin_;
  std::vector<Node> nodes_;
  std::vector<Constraint> constraints_;
  std::vector<Matrix6> roots_;
  std::vector<double> weights_;  // the problem's errors point here
  std::vector<double> chi2_;
  Eigen::Matrix<double, kDriftSize, 1> drift_ = Eigen::Matrix<double, kDriftSize, 1>::Zero();
  OdometryNoise noise_;  // that is assumed now
  int num_iterations_ = 0;
  ceres::EigenQuaternionManifold manifold_;
  std::unique_ptr<ceres::Problem> problem_;
};

absl::Status Check(const PoseGraph& graph, const GraphOptions& options) {
  const std::size_t num_scans = graph.T_odom_scan.size();
  if (num_scans == 0 || graph.T_map_scan.size() != num_scans) {
    return absl::InvalidArgumentError(
        absl::StrCat("the graph has ", num_scans, " poses of the odometry and ",
                     graph.T_map_scan.size(), " to begin with; give one of each a scan"));
  }
  if (!(options.max_chi2 > 0.0)) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_chi2 is ", options.max_chi2, "; it must be above 0"));
  }
  for (std::size_t i = 0; i < graph.constraints.size(); ++i) {
    const Constraint& constraint = graph.constraints[i];
    const std::size_t from = constraint.from.value_or(num_scans - 1);
    if (constraint.to >= num_scans || from >= num_scans || constraint.from == constraint.to) {
      return absl::InvalidArgumentError(
          absl::StrCat("constraint ", i, " is not between two of the ", num_scans, " scans"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

std::size_t OptimizedGraph::num_on() const {
  return static_cast<std::size_t>(std::ranges::count(is_on, true));
}

absl::StatusOr<OptimizedGraph> Optimize(const PoseGraph& graph, const GraphOptions& options) {
  RETURN_IF_ERROR(Check(graph, options));
  Solver solver(graph, options);
  RETURN_IF_ERROR(solver.FindRoots());
  return solver.Run();
}

}  // namespace scanloc::slam
