#include <pthread.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "asker.hpp"
#include "cli/output.hpp"
#include "lookout.hpp"
#include "node.hpp"
#include "options.hpp"
#include "scanloc/client/client.hpp"
#include "scanloc/client/offline_client.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::ros2 {
namespace {

sigset_t Watched() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  return signals;
}

/// Waits for SIGTERM and SIGINT on a thread of its own. Made before any other thread, so that none
/// of them gets these signals. The first one makes came() true; a second one ends the process.
class StopSignals {
 public:
  StopSignals() {
    const sigset_t signals = Watched();
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  }
  ~StopSignals() {
    if (!thread_.joinable()) return;
    ends_ = true;
    pthread_kill(thread_.native_handle(), SIGINT);
    thread_.join();
  }

  /// Calls on_stop when a signal comes, from that thread. Once.
  void Watch(std::function<void()> on_stop) {
    thread_ = std::thread([this, on_stop = std::move(on_stop)] {
      const sigset_t signals = Watched();
      int signal = 0;
      while (sigwait(&signals, &signal) != 0 || !ends_) {
        if (came_.exchange(true)) std::_Exit(128 + signal);
        on_stop();
      }
    });
  }
  [[nodiscard]] bool came() const { return came_; }

 private:
  std::atomic<bool> came_ = false;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

constexpr int kExitFailed = 1;
constexpr int kExitUsage = 2;
constexpr std::int64_t kReportEvery_ns = 1'000'000'000;

std::int64_t NowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::int64_t WallClockNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

int Complain(const absl::Status& status, int exit_status) {
  std::string message(status.message());
  std::ranges::replace(message, '\n', ' ');
  std::fprintf(stderr, "scanloc-ros2: %s\n", Printable(message).c_str());
  return exit_status;
}

absl::StatusOr<std::shared_ptr<const client::LocalizationClient>> MakeClient(
    const Options& options) {
  if (!options.map_file.empty()) return client::OfflineClient::Open(options.map_file);
  ASSIGN_OR_RETURN(auto client_options, cli::ClientOptionsOf(options.server));
  client_options.connect_timeout = std::chrono::milliseconds(0);  // it may come later
  auto client = client::Client::Connect(client_options);
  if (!client.ok()) return client.status();
  return std::make_shared<const client::Client>(*std::move(client));
}

/// Wakes a node from other threads, while there is one.
class Waker {
 public:
  /// Null: there is none any more, and no Wake of it is under way.
  void SetNode(Node* node) {
    const std::lock_guard lock(mutex_);
    node_ = node;
  }
  /// False if there is none.
  bool Wake() {
    const std::lock_guard lock(mutex_);
    if (node_ != nullptr) node_->Wake();
    return node_ != nullptr;
  }

 private:
  std::mutex mutex_;
  Node* node_ = nullptr;
};

/// Tells how things stand, on the topic and in the log.
class Reporter {
 public:
  Reporter(Node& node, const Lookout& lookout, bool quiet)
      : node_(node),
        lookout_(lookout),
        quiet_(quiet),
        last_message_(lookout.Diagnose(NowNs()).message),
        next_ns_(NowNs() + kReportEvery_ns) {}

  /// Once a second, and at once when things have changed.
  void Report() {
    const std::int64_t now_ns = NowNs();
    DiagnosticMessage diagnosis = lookout_.Diagnose(now_ns);
    if (diagnosis.message == last_message_ && now_ns < next_ns_) return;
    last_message_ = diagnosis.message;
    next_ns_ = now_ns + kReportEvery_ns;
    const Node::Health health = node_.health();
    if (!health.problem.empty()) {
      diagnosis.level = std::max(diagnosis.level, DiagnosticMessage::Level::kWarn);
      absl::StrAppend(&diagnosis.message, "; ", health.problem);
    }
    diagnosis.stamp_ns = WallClockNs();
    diagnosis.values.emplace_back("cloud_publishers", absl::StrCat(health.num_cloud_publishers));
    diagnosis.values.emplace_back("dropped_datagrams", absl::StrCat(health.num_dropped_datagrams));
    diagnosis.values.emplace_back("malformed_messages", absl::StrCat(health.num_malformed));
    node_.Publish(diagnosis);
    if (std::exchange(last_logged_, diagnosis.message) != diagnosis.message) Log(diagnosis);
  }
  [[nodiscard]] std::int64_t next_ns() const { return next_ns_; }

 private:
  void Log(const DiagnosticMessage& diagnosis) const {
    if (quiet_ && diagnosis.level != DiagnosticMessage::Level::kError) return;
    std::string where;
    for (const auto& [key, value] : diagnosis.values) {
      if (key == "robot_in_map" && diagnosis.level == DiagnosticMessage::Level::kOk) {
        where = ": " + value;
      }
    }
    std::fprintf(stderr, "scanloc-ros2: %s%s\n", diagnosis.message.c_str(), where.c_str());
  }

  Node& node_;
  const Lookout& lookout_;
  const bool quiet_;
  std::string last_message_;
  std::string last_logged_;
  std::int64_t next_ns_;
};

void Publish(const Told& told, Node& node) {
  if (told.initial_pose) node.PublishInitialPose(*told.initial_pose);
  if (told.pose) node.PublishPose(*told.pose);
  if (told.candidates) node.PublishCandidates(*told.candidates);
  if (told.map_odom) node.PublishTransform(*told.map_odom);
}

/// Takes what came and passes it on, once.
void Step(Node& node, Lookout& lookout, AskerThread& asker, std::int64_t until_ns) {
  const std::int64_t wait_ns = std::min(until_ns, lookout.NextChange_ns()) - NowNs();
  Node::Received received = node.Wait(std::chrono::nanoseconds(std::max<std::int64_t>(0, wait_ns)));
  if (received.has_trigger) lookout.TakeTrigger();
  for (const auto& pose : received.static_transforms) lookout.TakeStaticTransform(pose);
  for (const auto& pose : received.odometry) Publish(lookout.TakeOdometry(pose), node);
  for (auto& cloud : received.clouds) lookout.TakeCloud(std::move(cloud), NowNs());
  if (const auto reply = asker.TakeReply()) Publish(lookout.TakeReply(*reply, NowNs()), node);
  Publish(lookout.TakeListeners(node.num_listeners(), NowNs()), node);
  if (auto question = lookout.NextQuestion(NowNs())) asker.Start(*std::move(question));
}

int Run(const Options& options, StopSignals& signals) {
  Waker waker;
  signals.Watch([&waker] {
    if (!waker.Wake()) std::_Exit(EXIT_SUCCESS);  // nothing is published yet, or any more
  });
  auto client = MakeClient(options);
  if (!client.ok()) return Complain(client.status(), kExitFailed);
  auto node = Node::Create(options.node);
  if (!node.ok()) {
    return Complain(node.status(),
                    absl::IsInvalidArgument(node.status()) ? kExitUsage : kExitFailed);
  }
  waker.SetNode(node->get());
  auto asker = std::make_unique<AskerThread>(Asker(*client, options.stream), [&] { waker.Wake(); });
  absl::Status failure;
  {
    Lookout lookout(options.lookout);
    Reporter reporter(**node, lookout, options.quiet);
    std::cout << "scanloc-ros2 ready" << std::endl;
    while (!signals.came() && !lookout.IsDone(NowNs())) {
      Step(**node, lookout, *asker, reporter.next_ns());
      reporter.Report();
    }
    failure = lookout.failure();
  }
  if (!signals.came()) (void)(*node)->Flush(std::chrono::seconds(1));
  waker.SetNode(nullptr);
  node->reset();
  if (!failure.ok()) return Complain(failure, kExitFailed);
  // A question that a server has not answered yet is of no use any more.
  if (asker->IsBusy()) std::_Exit(EXIT_SUCCESS);
  return EXIT_SUCCESS;
}

int Main(int argc, char** argv) {
  cli::PrepareStandardStreams();
  StopSignals signals;
  CLI::App app(
      "Tells the ROS 2 stack of a robot that wakes up anywhere in a mapped town where it is.",
      "scanloc-ros2");
  app.set_version_flag("--version", "scanloc-ros2 " SCANLOC_VERSION);
  Options options;
  options.Declare(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const std::string text = absl::StrCat(error.what(), "; see scanloc-ros2 --help");
    return Complain(absl::InvalidArgumentError(text), kExitUsage);
  }
  if (absl::Status usage = options.Finish(); !usage.ok()) {
    return Complain(usage, kExitUsage);
  }
  try {
    return Run(options, signals);
  } catch (const std::exception& error) {
    return Complain(absl::InternalError(absl::StrCat("unexpected error: ", error.what())),
                    kExitFailed);
  }
}

}  // namespace
}  // namespace scanloc::ros2

int main(int argc, char** argv) { return scanloc::ros2::Main(argc, argv); }
