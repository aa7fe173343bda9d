#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

namespace scanloc::test {

/// A program that runs beside the test; killed at the end if it still does.
class Process {
 public:
  /// Longest that anything is waited for; only a test that fails waits so long.
  static constexpr std::chrono::seconds kPatience{60};

  /// Throws std::runtime_error if it cannot be started.
  explicit Process(const std::vector<std::string>& command);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The next line of its stdout, without the end of line; empty at the end of the stream.
  std::string ReadLine();

  void Signal(int signal) const;

  /// Waits for its end. Its exit status, or -signal if it died of one.
  int Wait();

  /// All that is left of stdout, and stderr; after Wait.
  [[nodiscard]] const std::string& rest_of_stdout() const { return out_.text; }
  [[nodiscard]] const std::string& stderr_text() const { return err_.text; }

 private:
  struct Stream {
    int fd = -1;
    std::string text;
  };

  /// Takes in what the process prints, until something came or both streams ended, which gives
  /// false.
  bool ReadSome();

  pid_t pid_ = -1;
  Stream out_;
  Stream err_;
};

}  // namespace scanloc::test
