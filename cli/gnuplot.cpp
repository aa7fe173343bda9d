#include "cli/gnuplot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "cli/output.hpp"

namespace scanloc::cli {
namespace {

constexpr const char* kScriptName = "charts.gp";
constexpr const char* kWordsName = "stderr.txt";

/// A folder of its own, removed with all that is in it.
class TemporaryFolder {
 public:
  static absl::StatusOr<TemporaryFolder> Make() {
    std::error_code error;
    const std::filesystem::path base = std::filesystem::temp_directory_path(error);
    if (error) {
      return absl::FailedPreconditionError(absl::StrCat("there is no folder for temporary files (",
                                                        error.message(), "); set TMPDIR"));
    }
    std::string path = base / "scanloc.XXXXXX";
    if (mkdtemp(path.data()) == nullptr) {
      return absl::ErrnoToStatus(errno, absl::StrCat("cannot make a temporary folder ", path));
    }
    return TemporaryFolder(path);
  }
  explicit TemporaryFolder(std::string path) : path_(std::move(path)) {}
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder() {
    std::error_code error;
    if (!path_.empty()) std::filesystem::remove_all(path_, error);
  }

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string File(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

std::optional<std::string> ReadText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Starts gnuplot on the script in the folder; its number, or the error of starting it.
absl::StatusOr<pid_t> Start(const std::string& folder) {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, kWordsName,
                                   O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  // This program ignores it, and what it starts would do so, too.
  sigset_t defaults;
  sigemptyset(&defaults);
  sigaddset(&defaults, SIGPIPE);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  // No settings of the user, which might change what is drawn.
  std::string program = "gnuplot";
  std::string no_settings = "--default-settings";
  std::string script = kScriptName;
  char* const arguments[] = {program.data(), no_settings.data(), script.data(), nullptr};
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, program.c_str(), &actions, &attributes, arguments, environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT) {
    return absl::FailedPreconditionError(
        "charts are drawn by gnuplot, and there is none in PATH: install it, on Debian by "
        "'apt-get install gnuplot-nox'");
  }
  if (error != 0) return absl::ErrnoToStatus(error, "cannot start gnuplot");
  return child;
}

/// What its status says against it; empty: it succeeded.
absl::StatusOr<std::string> WaitFor(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) == -1) {
    if (errno != EINTR) return absl::ErrnoToStatus(errno, "cannot wait for gnuplot");
  }
  if (WIFSIGNALED(status)) return absl::StrCat("was ended by signal ", WTERMSIG(status));
  if (WEXITSTATUS(status) != 0) return absl::StrCat("failed with status ", WEXITSTATUS(status));
  return "";
}

}  // namespace

std::string GnuplotQuoted(std::string_view text) {
  // Within single quotes only the quote itself means anything, and the line's end.
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') quoted += '\'';
    quoted += absl::ascii_iscntrl(static_cast<unsigned char>(c)) ? ' ' : c;
  }
  return quoted + "'";
}

absl::StatusOr<GnuplotOutput> RunGnuplot(const std::string& script,
                                         const std::vector<std::string>& files) {
  const absl::StatusOr<TemporaryFolder> folder = TemporaryFolder::Make();
  if (!folder.ok()) return folder.status();
  if (absl::Status s = WriteText(folder->File(kScriptName), script); !s.ok()) return s;
  const absl::StatusOr<pid_t> child = Start(folder->path());
  if (!child.ok()) return child.status();
  absl::StatusOr<std::string> fault = WaitFor(*child);
  if (!fault.ok()) return fault.status();
  GnuplotOutput output;
  // One line, as every error is.
  for (const char c : ReadText(folder->File(kWordsName)).value_or("")) {
    const bool is_gap = absl::ascii_isspace(static_cast<unsigned char>(c));
    if (!is_gap) output.warnings += c;
    if (is_gap && !output.warnings.empty() && output.warnings.back() != ' ') output.warnings += ' ';
  }
  for (const std::string& name : files) {
    std::optional<std::string> text = ReadText(folder->File(name));
    if (fault->empty() && (!text || !absl::StrContains(*text, "</svg>"))) {
      *fault = absl::StrCat("did not finish ", name);
    }
    output.files.push_back(std::move(text).value_or(""));
  }
  if (!fault->empty()) {
    return absl::InternalError(absl::StrCat("gnuplot ", *fault, ": ", output.warnings));
  }
  return output;
}

}  // namespace scanloc::cli
