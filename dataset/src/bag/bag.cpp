#include "scanloc/dataset/bag.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "bag/bag_file.hpp"
#include "bag/decompress.hpp"
#include "name_order.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/files/files.hpp"
#include "text.hpp"

namespace scanloc::dataset {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kZstdEnding = ".zstd";

bool IsBagName(const std::string& name) {
  const absl::string_view plain = absl::StripSuffix(name, kZstdEnding);
  return absl::EndsWith(plain, ".mcap") || absl::EndsWith(plain, ".db3") ||
         absl::EndsWith(plain, ".bag");
}

// The files that rosbag2 says it wrote to a folder; none without its metadata.
std::vector<std::string> NamedInMetadata(const std::string& folder) {
  constexpr std::int64_t kMaxBytes = 64 << 20;
  std::vector<std::string> names;
  const auto text = ReadFile((fs::path(folder) / "metadata.yaml").string(), kMaxBytes);
  if (!text.ok()) return names;
  bool is_list = false;
  LineReader lines(*text);
  while (const std::optional<std::string_view> line = lines.Next()) {
    absl::string_view entry = absl::StripAsciiWhitespace(ToAbsl(*line));
    if (is_list && absl::ConsumePrefix(&entry, "- ")) names.emplace_back(entry);
    is_list = entry == "relative_file_paths:" || (is_list && line->find("- ") != line->npos);
  }
  return names;
}

// The bags of a folder in natural order; rosbag2 numbers the parts of one without leading zeros.
// What is there plain and compressed is taken once, and a note says so.
absl::StatusOr<std::vector<std::string>> ListFolder(const std::string& folder,
                                                    std::vector<std::string>* notes) {
  std::vector<std::string> names;
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    std::string name = entry->path().filename().string();
    if (name.front() != '.' && IsBagName(name)) names.push_back(std::move(name));
  }
  if (error) return absl::ErrnoToStatus(error.value(), absl::StrCat(folder, ": cannot be listed"));
  const std::set<std::string> all(names.begin(), names.end());
  std::erase_if(names, [&](const std::string& name) {
    const std::string plain(absl::StripSuffix(name, kZstdEnding));
    if (plain == name || !all.contains(plain)) return false;
    notes->push_back(absl::StrCat(folder, ": ", Quote(name), " is left out, because ", Quote(plain),
                                  " is there, too"));
    return true;
  });
  if (names.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(folder, ": holds no bag (.mcap, .db3 or .bag, or one of these .zstd)"));
  }
  // As many under other names were renamed.
  if (const auto named = NamedInMetadata(folder); named.size() > names.size()) {
    const auto missing = std::ranges::find_if(named, [&](const std::string& name) {
      const std::string file = fs::path(name).filename().string();
      return !all.contains(file) &&
             !all.contains(std::string(absl::StripSuffix(file, kZstdEnding)));
    });
    if (missing != named.end()) {
      notes->push_back(absl::StrCat(folder, ": metadata.yaml names ", named.size(),
                                    " files, of which ", names.size(), " are there; ",
                                    Quote(*missing), " is not, and what it held is missing"));
    }
  }
  std::vector<std::string> paths;
  for (const std::size_t i : OrderNames({names.begin(), names.end()}).order) {
    paths.push_back((fs::path(folder) / names[i]).string());
  }
  return paths;
}

// The type of a topic, and whose: both have the same names.
std::string Told(const FileTopic& topic) {
  const char* of = topic.format == WireFormat::kCdr    ? " of ROS 2"
                   : topic.format == WireFormat::kRos1 ? " of ROS 1"
                                                       : " of an unknown encoding";
  return absl::StrCat(Quote(topic.type), of);
}

}  // namespace

struct Bag::Impl {
  struct Entry {
    std::uint32_t file;
    std::uint32_t index;  ///< of the file's messages
  };

  std::vector<std::unique_ptr<BagFile>> files;
  std::vector<std::vector<std::uint32_t>> topic_of;  ///< file, topic of the file: topic of the bag
  std::vector<Entry> entries;                        ///< in the order of time

  [[nodiscard]] const MessageRef& Ref(std::size_t id) const {
    return files[entries[id].file]->messages()[entries[id].index];
  }
  [[nodiscard]] std::uint32_t TopicOf(std::size_t id) const {
    return topic_of[entries[id].file][Ref(id).topic];
  }
};

std::string BagDamage::Text() const {
  const auto count = [](std::string* out, const std::pair<const std::string, std::size_t>& of) {
    absl::StrAppend(out, of.second, of.second == 1 ? " message of " : " messages of ",
                    Quote(of.first));
  };
  return absl::StrCat(absl::StrJoin(num_messages, ", ", count),
                      " cannot be read and are left out; the first: ", first);
}

Bag::Bag(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Bag::~Bag() = default;

absl::StatusOr<std::shared_ptr<const Bag>> Bag::Open(const std::vector<std::string>& paths) {
  std::vector<std::string> files;
  std::vector<std::string> notes;
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      files.push_back(path);
      continue;
    }
    ASSIGN_OR_RETURN(const std::vector<std::string> inside, ListFolder(path, &notes));
    files.insert(files.end(), inside.begin(), inside.end());
  }
  if (files.empty()) return absl::InvalidArgumentError("no bag is given");

  std::shared_ptr<Bag> bag(new Bag(std::make_unique<Impl>()));
  bag->notes_ = std::move(notes);
  Impl& impl = *bag->impl_;
  std::map<std::string, std::pair<FileTopic, std::string>> topics;  // by name; and of which file
  for (const std::string& path : files) {
    ASSIGN_OR_RETURN(std::unique_ptr<BagFile> file, OpenBagFile(path));
    for (const FileTopic& topic : file->topics()) {
      const auto& [known, of] = topics.try_emplace(topic.name, topic, path).first->second;
      if (known.type != topic.type || known.format != topic.format) {
        return absl::InvalidArgumentError(
            absl::StrCat("topic ", Quote(topic.name), " is of type ", Told(known), " in ", of,
                         " but of ", Told(topic), " in ", path, "; read these apart"));
      }
    }
    const auto& of_file = file->notes();
    bag->notes_.insert(bag->notes_.end(), of_file.begin(), of_file.end());
    impl.files.push_back(std::move(file));
  }
  for (const auto& [name, topic] : topics) {
    bag->topics_.push_back({.name = name, .type = topic.first.type, .format = topic.first.format});
  }
  for (std::size_t f = 0; f < impl.files.size(); ++f) {
    const BagFile& file = *impl.files[f];
    std::vector<std::uint32_t>& topic_of = impl.topic_of.emplace_back();
    for (const FileTopic& topic : file.topics()) {
      topic_of.push_back(
          static_cast<std::uint32_t>(std::distance(topics.begin(), topics.find(topic.name))));
    }
    for (std::size_t i = 0; i < file.messages().size(); ++i) {
      const MessageRef& message = file.messages()[i];
      BagTopic& topic = bag->topics_[topic_of[message.topic]];
      const bool is_first = topic.num_messages++ == 0;
      topic.first_ns =
          is_first ? message.log_time_ns : std::min(topic.first_ns, message.log_time_ns);
      topic.last_ns = is_first ? message.log_time_ns : std::max(topic.last_ns, message.log_time_ns);
      impl.entries.push_back({static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(i)});
    }
  }
  std::vector<Impl::Entry>& entries = impl.entries;
  std::ranges::stable_sort(entries, [&](const Impl::Entry& a, const Impl::Entry& b) {
    return impl.files[a.file]->messages()[a.index].log_time_ns <
           impl.files[b.file]->messages()[b.index].log_time_ns;
  });
  return bag;
}

const BagTopic* Bag::FindTopic(std::string_view name) const {
  const auto found = std::ranges::find(topics_, name, &BagTopic::name);
  return found == topics_.end() ? nullptr : &*found;
}

std::vector<std::size_t> Bag::Messages(const std::vector<const BagTopic*>& topics) const {
  std::vector<bool> wanted(topics_.size());
  for (const BagTopic* topic : topics) {
    wanted[static_cast<std::size_t>(topic - topics_.data())] = true;
  }
  std::vector<std::size_t> ids;
  for (std::size_t id = 0; id < impl_->entries.size(); ++id) {
    if (wanted[impl_->TopicOf(id)]) ids.push_back(id);
  }
  return ids;
}

absl::Status Bag::ForEach(const std::vector<const BagTopic*>& topics, const Handler& handle,
                          BagDamage* damage) const {
  for (const std::size_t id : Messages(topics)) {
    absl::Status status = Read(id, handle);
    if (absl::IsDataLoss(status) && damage != nullptr) {
      if (damage->empty()) damage->first = absl::StrCat(status.message());
      ++damage->num_messages[topics_[impl_->TopicOf(id)].name];
    } else if (!status.ok()) {
      return status;
    }
  }
  return absl::OkStatus();
}

absl::Status Bag::Read(std::size_t id, const Handler& handle) const {
  const MessageRef& ref = impl_->Ref(id);
  const BagTopic& topic = topics_[impl_->TopicOf(id)];
  ASSIGN_OR_RETURN(const MessageBytes read, impl_->files[impl_->entries[id].file]->Read(ref));
  // rosbag2 may compress messages one by one, whatever it writes them to; CDR begins otherwise.
  if (topic.format != WireFormat::kCdr || !read.bytes.starts_with(kZstdMagic)) {
    return handle({&topic, ref.log_time_ns, read.bytes, id});
  }
  const absl::StatusOr<FileBytes> bytes = DecompressZstd(read.bytes, limits::kMaxBagChunkBytes);
  if (!bytes.ok()) {
    return Annotate(bytes.status(), absl::StrCat("topic ", Quote(topic.name),
                                                 ", message recorded at ", ref.log_time_ns, " ns"));
  }
  return handle({&topic, ref.log_time_ns, bytes->view(), id});
}

}  // namespace scanloc::dataset
