#pragma once

#include <sys/stat.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "scanloc/core/map_use.hpp"
#include "scanloc/proto/viewer.hpp"

namespace scanloc::server {

/// How one map fares in use, in memory and in the file beside it. Thread-safe.
class UseCounter {
 public:
  /// Of a map of that content and so many places, in place of the counter that had the file before.
  UseCounter(std::string file, std::string content_id, std::int64_t num_places,
             std::shared_ptr<UseCounter> before = nullptr);

  /// Goes on from the file if it is of this content. What else lies there is set aside as FILE.old,
  /// and taken up again when its map is; nothing of it is an error, but told in the log. Once.
  void Load();

  void Count(const Answer& answer, std::optional<std::int32_t> last_found, std::int64_t now_ns);

  /// As PageOfUse.
  [[nodiscard]] absl::StatusOr<PlaceUsePage> Page(std::int32_t first_place, int max_places) const;

  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] const std::string& content_id() const { return content_id_; }

  /// Writes what was counted since. Where the file cannot be written that is told once, and tried
  /// again the next time; where another server writes it, it is left to that one.
  void Write();

  /// From then on nothing is written: the file is another map's.
  void Close();

 private:
  struct FileState {
    dev_t device = 0;
    ino_t inode = 0;
    std::int64_t modified_ns = 0;

    friend bool operator==(const FileState&, const FileState&) = default;
  };
  [[nodiscard]] std::optional<FileState> Look() const;
  void ReadFile();

  const std::string file_;
  const std::string content_id_;
  const std::int64_t num_places_;
  std::once_flag loaded_;
  std::shared_ptr<UseCounter> before_;  // until loaded
  std::mutex writing_;                  // before mutex_
  std::optional<FileState> known_;
  bool is_told_ = false;  // that it could not be written
  bool is_closed_ = false;
  mutable std::mutex mutex_;
  MapUse use_;
  bool is_changed_ = false;
};

/// The counters of all maps in service, written every so often. Thread-safe.
class UseBook {
 public:
  /// 0: nothing is counted.
  explicit UseBook(std::chrono::duration<double> period);
  ~UseBook();

  /// The counter of a map, loaded; maps of one file and content share one. Null if nothing is
  /// counted. Who opens another map does not wait for the file of this.
  [[nodiscard]] std::shared_ptr<UseCounter> Open(const std::string& map_path,
                                                 const std::string& content_id,
                                                 std::int64_t num_places);

  /// Writes what is left, and nothing from then on.
  void Stop();

 private:
  void Work();
  void WriteAll();

  const std::chrono::duration<double> period_;
  std::mutex mutex_;
  std::condition_variable wakes_;
  bool is_stopping_ = false;
  std::vector<std::shared_ptr<UseCounter>> counters_;
  std::thread thread_;  // started with the first map
};

}  // namespace scanloc::server
