#include "request_text.hpp"

#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "scanloc/core/printable.hpp"
#include "scanloc/core/status_macros.hpp"

namespace scanloc::client {
namespace {

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t num_bytes = FirstUtf8Character(text).num_bytes;
    if (num_bytes == 0) return false;
    text.remove_prefix(num_bytes);
  }
  return true;
}

}  // namespace

absl::Status CheckTexts(const google::protobuf::Message& request) {
  using google::protobuf::FieldDescriptor;
  const google::protobuf::Reflection& reflection = *request.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(request, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->is_repeated()) continue;  // none holds texts
    if (field->type() == FieldDescriptor::TYPE_STRING) {
      const std::string text = reflection.GetString(request, field);
      if (IsUtf8(text)) continue;
      return absl::InvalidArgumentError(absl::StrCat(field->name(), " is \"", Printable(text),
                                                     "\", which is not UTF-8 text; rename it"));
    }
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    RETURN_IF_ERROR(CheckTexts(reflection.GetMessage(request, field)));
  }
  return absl::OkStatus();
}

}  // namespace scanloc::client
