#include "support/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill is POSIX
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace scanloc::test {

Process::Process(const std::vector<std::string>& command, const ProcessOptions& options) {
  std::array<int, 2> out{};
  std::array<int, 2> err{};
  // In packet mode each write takes up a page, and the pipe of `in_step` has a single one.
  const int out_flags = options.in_step ? O_CLOEXEC | O_DIRECT : O_CLOEXEC;
  if (pipe2(out.data(), out_flags) != 0 || pipe2(err.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("no pipe");
  }
  if (options.in_step && fcntl(out[1], F_SETPIPE_SZ, getpagesize()) != getpagesize()) {
    throw std::runtime_error("no pipe of a single page");
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (options.close_stdout) {
    posix_spawn_file_actions_addclose(&actions, STDOUT_FILENO);
  } else if (!options.stdout_path.empty()) {
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, options.stdout_path.c_str(), O_WRONLY,
                                     0);
  } else {
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  }
  if (options.stderr_path.empty()) {
    posix_spawn_file_actions_adddup2(&actions, options.merge_stderr ? STDOUT_FILENO : err[1],
                                     STDERR_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, options.stderr_path.c_str(),
                                     O_WRONLY | O_CREAT | O_APPEND, 0666);
  }
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  std::vector<char*> environment;  // of a name given twice the first counts
  for (const std::string& variable : options.environment) {
    environment.push_back(const_cast<char*>(variable.c_str()));
  }
  for (char** variable = environ; *variable != nullptr; ++variable) {
    environment.push_back(*variable);
  }
  environment.push_back(nullptr);
  const int failed =
      posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);
  close(out[1]);
  close(err[1]);
  out_.fd = out[0];
  err_.fd = err[0];
  if (failed != 0) throw std::runtime_error("cannot start " + command.front());
}

Process::~Process() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  for (const int fd : {out_.fd, err_.fd}) {
    if (fd >= 0) close(fd);
  }
}

bool Process::ReadSome() {
  if (out_.fd < 0 && err_.fd < 0) return false;
  std::array<pollfd, 2> polled = {pollfd{out_.fd, POLLIN, 0}, pollfd{err_.fd, POLLIN, 0}};
  const int timeout_ms = static_cast<int>(std::chrono::milliseconds(kPatience).count());
  if (poll(polled.data(), polled.size(), timeout_ms) <= 0) {
    throw std::runtime_error("the process says nothing; stderr so far: " + err_.text);
  }
  for (const auto& [stream, events] :
       {std::pair(&out_, polled[0].revents), std::pair(&err_, polled[1].revents)}) {
    if (events == 0) continue;
    std::array<char, 4096> chunk{};
    const ssize_t num_read = read(stream->fd, chunk.data(), chunk.size());
    if (num_read > 0) {
      stream->text.append(chunk.data(), static_cast<std::size_t>(num_read));
    } else {
      close(std::exchange(stream->fd, -1));
    }
  }
  return true;
}

std::optional<std::string> Process::NextLine() {
  std::size_t end = out_.text.find('\n');
  while (end == std::string::npos && out_.fd >= 0 && ReadSome()) end = out_.text.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = out_.text.substr(0, end);
  out_.text.erase(0, end + 1);
  return line;
}

std::string Process::ReadLine() { return NextLine().value_or(""); }

std::string Process::ReadLineWith(const std::string& text) {
  while (std::optional<std::string> line = NextLine()) {
    if (line->find(text) != std::string::npos) return *std::move(line);
  }
  return {};
}

void Process::CloseStdout() {
  if (out_.fd >= 0) close(std::exchange(out_.fd, -1));
}

void Process::Signal(int signal) const { kill(pid_, signal); }

long Process::StatusOf(const std::string& field) const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(file, line);) {
    if (line.compare(0, field.size() + 1, field + ":") == 0) {
      return std::stol(line.substr(field.size() + 1));
    }
  }
  throw std::runtime_error("the process has no " + field);
}

int Process::Wait() {
  while (ReadSome()) {
  }
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

ProcessResult RunProcess(const std::vector<std::string>& command, const ProcessOptions& options) {
  Process process(command, options);
  const int status = process.Wait();
  return {.status = status, .out = process.rest_of_stdout(), .err = process.stderr_text()};
}

}  // namespace scanloc::test
