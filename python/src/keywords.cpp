#include "keywords.hpp"

#include "absl/strings/str_cat.h"
#include "errors.hpp"

namespace nb = nanobind;

namespace scanloc::python {

void Keywords::RefuseType(const char* name, nb::handle value) {
  const std::string type = nb::str(value.type()).c_str();
  throw nb::type_error(absl::StrCat(name, " is of the wrong type, ", type).c_str());
}

void Keywords::CheckAllTaken() const {
  for (const auto& [name, value] : given_) {
    const std::string text = nb::cast<std::string>(name);
    if (!taken_.contains(text)) {
      throw nb::type_error(absl::StrCat("got an unexpected keyword argument '", text, "'").c_str());
    }
  }
}

Query TakeQuery(Keywords& keywords) {
  Query query;
  if (const auto method = keywords.Take<std::string>("method")) {
    query.method = OrThrow(ParseMethod(*method));
  }
  query.num_candidates = keywords.Take<int>("num_candidates");
  query.threshold = keywords.Take<double>("threshold");
  query.min_confidence = keywords.Take<double>("min_confidence");
  query.max_answers = keywords.Take<int>("max_answers").value_or(query.max_answers);
  query.prior = keywords.Take<Prior>("prior").value_or(query.prior);
  return query;
}

client::RequestOptions TakeRequest(Keywords& keywords) {
  client::RequestOptions request{.query = TakeQuery(keywords)};
  request.mount = keywords.Take<SensorMount>("mount").value_or(request.mount);
  request.header.stamp_ns = keywords.Take<std::int64_t>("stamp_ns").value_or(0);
  request.header.frame_id = keywords.Take<std::string>("frame_id").value_or("");
  return request;
}

client::StreamOptions TakeStream(Keywords& keywords) {
  client::StreamOptions stream{.query = TakeQuery(keywords)};
  stream.mount = keywords.Take<SensorMount>("mount").value_or(stream.mount);
  stream.max_step_m = keywords.Take<double>("max_step_m").value_or(stream.max_step_m);
  return stream;
}

}  // namespace scanloc::python
