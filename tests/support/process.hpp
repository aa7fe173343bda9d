#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace scanloc::test {

/// Where a program's output goes, and what it finds.
struct ProcessOptions {
  std::string stdout_path;    ///< a file that stdout goes to, instead of being taken in
  bool close_stdout = false;  ///< the program starts without a stdout
  bool merge_stderr = false;  ///< stderr goes where stdout goes
  std::string stderr_path;    ///< a file, made if need be, that stderr is added to
  /// NAME=VALUE, beside the variables of the test itself.
  std::vector<std::string> environment;
  /// Its stdout holds one write: the program waits with the next until the test has read that one,
  /// and so cannot run ahead of it by more.
  bool in_step = false;
};

/// A program that runs beside the test; killed at the end if it still does.
class Process {
 public:
  /// Longest that anything is waited for; only a test that fails waits so long.
  static constexpr std::chrono::seconds kPatience{60};

  /// Throws std::runtime_error if it cannot be started.
  explicit Process(const std::vector<std::string>& command, const ProcessOptions& options = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The next line of its stdout, without the end of line; empty at the end of the stream.
  std::string ReadLine();

  /// Passes over lines of its stdout up to one that contains the text, and returns that one; empty
  /// if the stream ends before.
  std::string ReadLineWith(const std::string& text);

  /// Takes in no more of its stdout: what it writes from now on finds a closed pipe.
  void CloseStdout();

  void Signal(int signal) const;

  [[nodiscard]] pid_t pid() const { return pid_; }

  /// A number of its /proc/PID/status, such as VmHWM [kB] or Threads.
  [[nodiscard]] long StatusOf(const std::string& field) const;

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

  /// The next line of stdout; none at the end of the stream.
  std::optional<std::string> NextLine();

  pid_t pid_ = -1;
  Stream out_;
  Stream err_;
};

/// What became of a program.
struct ProcessResult {
  int status = 0;  ///< exit status, or -signal
  std::string out;
  std::string err;
};

/// Runs a program to its end.
ProcessResult RunProcess(const std::vector<std::string>& command,
                         const ProcessOptions& options = {});

}  // namespace scanloc::test
