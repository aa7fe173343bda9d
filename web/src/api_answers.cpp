// What was answered, and what is asked here.
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "api.hpp"
#include "api_asked.hpp"
#include "json.hpp"
#include "scanloc/core/method.hpp"
#include "scanloc/core/scan/descriptor.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/dataset/scan_reader.hpp"

namespace scanloc::web {
namespace {

/// An event of an answer is known by the run and its number: who comes back gets what he missed.
std::string EventId(const std::string& run, std::uint64_t number) {
  return absl::StrCat(run, ":", number);
}

AnswersPage PageAfter(const std::string& event_id) {
  AnswersPage page;
  const std::vector<std::string> parts = absl::StrSplit(event_id, ':');
  if (parts.size() == 2 && absl::SimpleAtoi(parts[1], &page.next_after)) page.run = parts[0];
  return page;
}

absl::StatusOr<client::RequestOptions> OptionsOf(const Request& request) {
  client::RequestOptions options{.map = request.Parameter("map").value_or(""),
                                 .request_id = request.request_id};
  if (const auto method = request.Parameter("method")) {
    ASSIGN_OR_RETURN(options.query.method, ParseMethod(*method));
  }
  if (const auto top = request.Parameter("top")) {
    ASSIGN_OR_RETURN(options.query.max_answers, ToNumber<int>("top", *top));
  }
  if (const auto least = request.Parameter("min_confidence")) {
    ASSIGN_OR_RETURN(options.query.min_confidence, ToNumber<double>("min_confidence", *least));
  }
  return options;
}

}  // namespace

Api::Answer Api::ListAnswers(const Asked& asked) const {
  AnswersPage last;
  last.run = asked.request.Parameter("run").value_or("");
  if (const auto after = asked.request.Parameter("after")) {
    ASSIGN_OR_RETURN(last.next_after, ToNumber<std::uint64_t>("after", *after));
  }
  ASSIGN_OR_RETURN(const auto page,
                   asked.client->ListAnswers(asked.request.Parameter("map").value_or(""), last));
  Json answers = Json::array();
  for (const SeenAnswer& answer : page.answers) answers.push_back(ToJson(answer));
  return Document200(
      {{"run", page.run}, {"next_after", page.next_after}, {"answers", std::move(answers)}});
}

Api::Answer Api::WatchAnswers(const Asked& asked) const {
  const std::string map = asked.request.Parameter("map").value_or("");
  const AnswersPage start = PageAfter(asked.request.last_event_id.empty()
                                          ? asked.request.Parameter("last_event_id").value_or("")
                                          : asked.request.last_event_id);
  // Asked once before the stream begins, so that what is wrong is told as usual.
  ASSIGN_OR_RETURN(auto first, asked.client->ListAnswers(map, start));
  // A quiet stream says that it is there, and finds out whether anybody listens.
  constexpr int kTurnsOfSilence = 20;
  const auto next = [client = asked.client, map, page = std::move(first), is_first = true,
                     silent = 0]() mutable -> std::optional<std::string> {
    if (!std::exchange(is_first, false)) {
      auto further = client->ListAnswers(map, page);
      if (!further.ok()) {
        if (absl::IsUnavailable(further.status()) || absl::IsDeadlineExceeded(further.status()) ||
            absl::IsResourceExhausted(further.status())) {
          return ++silent % kTurnsOfSilence == 0 ? ": the server is away\n\n" : "";
        }
        return std::nullopt;
      }
      page = *std::move(further);
    }
    std::string text;
    for (const SeenAnswer& answer : page.answers) {
      absl::StrAppend(&text, "id: ", EventId(page.run, answer.number),
                      "\nevent: answer\ndata: ", ToLine(ToJson(answer)), "\n\n");
    }
    if (!text.empty()) silent = 0;
    if (text.empty() && silent++ % kTurnsOfSilence == 0) text = ": nothing new\n\n";
    return text;
  };
  return Response{.content_type = "text/event-stream", .events = next};
}

Api::Answer Api::Localize(const Asked& asked) const {
  const Request& request = asked.request;
  ASSIGN_OR_RETURN(const auto options, OptionsOf(request));
  if (request.body.empty()) {
    return absl::InvalidArgumentError(
        "the body is empty; it must be a scan: PCD, PLY, KITTI .bin or NAVER .npy");
  }
  const auto format = request.Parameter("format");
  const std::string name = format ? absl::StrCat("scan.", *format) : "scan";
  if (format && !dataset::IsScanFile(name)) {
    return absl::InvalidArgumentError(
        absl::StrCat("format is \"", format->substr(0, 40), "\"; it must be bin, npy, pcd or ply"));
  }
  const std::string structure = request.Parameter("structure").value_or("false");
  if (structure != "true" && structure != "false") {
    return absl::InvalidArgumentError(
        absl::StrCat("structure is \"", structure.substr(0, 40), "\"; it must be true or false"));
  }
  ASSIGN_OR_RETURN(const auto scan, dataset::ReadScanBytes(request.body, name));
  ASSIGN_OR_RETURN(const auto reply, asked.client->LocalizeByDescriptor(scan.points, options));
  Json json = ToJson(reply);
  json["num_points"] = scan.points.size();
  if (structure == "true") {
    ASSIGN_OR_RETURN(const auto info, asked.client->GetMapInfo(reply.map));
    ASSIGN_OR_RETURN(auto describer, Describer::Create(info.params));
    json["posts_cm"] = PostsToJson(describer.Describe(scan.points).structure);
  }
  return Document200(json);
}

}  // namespace scanloc::web
