#include "scanloc/dataset/bag.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>

#include "absl/strings/str_format.h"
#include "cli/command.hpp"
#include "cli/output.hpp"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/report/json.hpp"

namespace scanloc::cli {
namespace {

class BagCommand : public Command {
 public:
  BagCommand() : Command("bag", "List the topics of a recorded bag: types, numbers, times") {}
  void Declare(CLI::App& app) override {
    app.add_option("BAG", paths_,
                   "MCAP, rosbag2's folder or .db3, or ROS 1's .bag; several are read as one")
        ->required()
        ->type_name("FILE|DIR");
    app.add_flag("--json", json_, "One JSON document on standard output");
    app.footer(
        "Times are those of recording. Topics of sensor_msgs/PointCloud2 go into --topic of "
        "build,\n"
        "locate and eval; those of nav_msgs/Odometry and geometry_msgs/PoseStamped into "
        "--poses-from.\n"
        "Example:\n"
        "  scanloc bag drive.mcap");
  }
  [[nodiscard]] absl::Status Run() override {
    ASSIGN_OR_RETURN(const auto bag, dataset::Bag::Open(paths_));
    for (const std::string& note : bag->notes()) {
      std::cerr << "scanloc: note: " << Printable(note) << '\n';
    }
    return WriteText("-", json_ ? AsJson(*bag) : AsTable(*bag));
  }

 private:
  static std::string AsJson(const dataset::Bag& bag) {
    report::Json document{{"topics", report::Json::array()}, {"notes", bag.notes()}};
    for (const dataset::BagTopic& topic : bag.topics()) {
      document["topics"].push_back({{"name", topic.name},
                                    {"type", topic.type},
                                    {"num_messages", topic.num_messages},
                                    {"first_ns", topic.first_ns},
                                    {"last_ns", topic.last_ns}});
    }
    return report::ToText(document);
  }

  static std::string AsTable(const dataset::Bag& bag) {
    int name_width = 5;
    int type_width = 4;
    for (const dataset::BagTopic& topic : bag.topics()) {
      name_width = std::max(name_width, static_cast<int>(Printable(topic.name).size()));
      type_width = std::max(type_width, static_cast<int>(Printable(topic.type).size()));
    }
    std::string table = absl::StrFormat("%-*s  %-*s  %8s  %14s  %14s\n", name_width, "topic",
                                        type_width, "type", "messages", "first [s]", "last [s]");
    for (const dataset::BagTopic& topic : bag.topics()) {
      constexpr double kSPerNs = 1e-9;
      absl::StrAppendFormat(&table, "%-*s  %-*s  %8d  %14.3f  %14.3f\n", name_width,
                            Printable(topic.name), type_width, Printable(topic.type),
                            topic.num_messages, kSPerNs * static_cast<double>(topic.first_ns),
                            kSPerNs * static_cast<double>(topic.last_ns));
    }
    return table;
  }

  std::vector<std::string> paths_;
  bool json_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeBagCommand() { return std::make_unique<BagCommand>(); }

}  // namespace scanloc::cli
