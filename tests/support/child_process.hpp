#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

namespace scanloc::test {

/// Starts body() in a forked process, which ends with its result as exit status.
template <typename Body>
pid_t StartChild(Body&& body) {
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) _exit(body());
  return child;
}

/// Waits for the child: its exit status, or minus the signal that killed it.
inline int WaitForChild(pid_t child) {
  int status = 0;
  if (waitpid(child, &status, 0) != child) throw std::runtime_error("cannot wait for the child");
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

template <typename Body>
int RunInChild(Body&& body) {
  return WaitForChild(StartChild(body));
}

}  // namespace scanloc::test
