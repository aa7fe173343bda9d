#include "cli/pdf.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <iostream>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace scanloc::cli {
namespace {

// Waits for the program's end. NotFound, Internal.
absl::Status Run(std::array<const char*, 5> arguments) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  pid_t pid = 0;
  // The program does not write to its arguments.
  const int error = posix_spawnp(&pid, arguments[0], &actions, nullptr,
                                 const_cast<char* const*>(arguments.data()), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) return absl::ErrnoToStatus(error, arguments[0]);
  int ended = 0;
  while (waitpid(pid, &ended, 0) < 0) {
    if (errno != EINTR) return absl::ErrnoToStatus(errno, arguments[0]);
  }
  if (WIFEXITED(ended) && WEXITSTATUS(ended) == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(arguments[0], " failed"));
}

absl::Status MakePdf(const std::string& svg, const std::string& pdf) {
  const std::string temporary = absl::StrCat(pdf, ".part");
  const std::string output = absl::StrCat("--output=", temporary);
  absl::Status status = Run({"rsvg-convert", "--format=pdf", output.c_str(), svg.c_str(), nullptr});
  if (status.ok() && rename(temporary.c_str(), pdf.c_str()) != 0) {
    status = absl::ErrnoToStatus(errno, pdf);
  }
  if (!status.ok()) unlink(temporary.c_str());
  return status;
}

}  // namespace

absl::Status MakePdfs(const std::string& folder,
                      const std::vector<std::pair<std::string, std::string>>& files) {
  for (const auto& [name, text] : files) {
    if (!absl::EndsWith(name, ".svg")) continue;
    const std::string front = absl::StrCat(folder, "/", name.substr(0, name.size() - 4));
    absl::Status made = MakePdf(front + ".svg", front + ".pdf");
    if (absl::IsNotFound(made)) {
      std::cerr << "scanloc: note: the figures are made as SVG only; for PDF there must be "
                   "rsvg-convert (Debian: librsvg2-bin)\n";
      return absl::OkStatus();
    }
    if (!made.ok()) return made;
  }
  return absl::OkStatus();
}

}  // namespace scanloc::cli
