#pragma once

#include <Python.h>
#include <cxxabi.h>
#include <unistd.h>

/// The interpreter's lock, released and taken so that the program may end meanwhile: Pythons before
/// 3.14 end a thread that then asks for the lock by unwinding it, which no C++ below survives. As
/// with later ones, such a thread stays where it is until the process is gone.
namespace scanloc::python {

template <typename Take>
void TakeLock(Take&& take) {
  try {
    take();
  } catch (const abi::__forced_unwind&) {
    while (true) pause();
  }
}

class Unlock {
 public:
  Unlock() : thread_(PyEval_SaveThread()) {}
  ~Unlock() {
    TakeLock([this] { PyEval_RestoreThread(thread_); });
  }
  Unlock(const Unlock&) = delete;
  Unlock& operator=(const Unlock&) = delete;

 private:
  PyThreadState* thread_;
};

/// On any thread, whether it holds the lock or not.
class Lock {
 public:
  Lock() {
    TakeLock([this] { state_ = PyGILState_Ensure(); });
  }
  ~Lock() { PyGILState_Release(state_); }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  PyGILState_STATE state_ = PyGILState_UNLOCKED;
};

}  // namespace scanloc::python
