// A shared library for LD_PRELOAD: the wall clock of the process runs ahead by as many seconds as
// the file $SCANLOC_CLOCK_OFFSET_FILE says, eight bytes that the test changes while it runs. What
// measures time that passes (CLOCK_MONOTONIC) is as it was, as when an operator sets the clock.
// What waits until a time of the wall clock waits as long as it would without the shift.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>  // NOLINT(modernize-deprecated-headers): clock_gettime is POSIX
#include <unistd.h>

#include <atomic>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>

namespace {

using Offset = std::atomic<std::int64_t>;
static_assert(sizeof(Offset) == sizeof(std::int64_t) && Offset::is_always_lock_free);

const Offset* MapOffset() {
  static const Offset none = 0;
  const char* path = std::getenv("SCANLOC_CLOCK_OFFSET_FILE");
  const int fd = path == nullptr ? -1 : open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return &none;
  void* mapped = mmap(nullptr, sizeof(Offset), PROT_READ, MAP_SHARED, fd, 0);
  close(fd);
  return mapped == MAP_FAILED ? &none : static_cast<const Offset*>(mapped);
}

std::int64_t Offset_s() {
  static const Offset* const offset = MapOffset();
  return offset->load(std::memory_order_relaxed);
}

using Syscall = long (*)(long, ...);

Syscall NextSyscall() {
  static const auto next = reinterpret_cast<Syscall>(dlsym(RTLD_NEXT, "syscall"));
  return next;
}

bool WaitsForWallClock(long number, int operation) {
  return number == SYS_futex && (operation & FUTEX_CMD_MASK) == FUTEX_WAIT_BITSET &&
         (operation & FUTEX_CLOCK_REALTIME) != 0;
}

}  // namespace

extern "C" {

// Abseil, and so gRPC, waits by it; the kernel does not know of the shift.
long syscall(long number, ...) noexcept {
  va_list list;
  va_start(list, number);
  long arguments[6];
  for (long& argument : arguments) argument = va_arg(list, long);
  va_end(list);
  timespec until = {};
  if (WaitsForWallClock(number, static_cast<int>(arguments[1])) && arguments[3] != 0) {
    until = *reinterpret_cast<const timespec*>(arguments[3]);
    until.tv_sec -= Offset_s();
    arguments[3] = reinterpret_cast<long>(&until);
  }
  return NextSyscall()(number, arguments[0], arguments[1], arguments[2], arguments[3], arguments[4],
                       arguments[5]);
}

int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const int result = static_cast<int>(NextSyscall()(SYS_clock_gettime, clock, now));
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
    now->tv_sec += Offset_s();
  }
  return result;
}

int gettimeofday(timeval* now, void*) noexcept {
  timespec precise = {};
  if (clock_gettime(CLOCK_REALTIME, &precise) != 0) return -1;
  *now = {.tv_sec = precise.tv_sec, .tv_usec = precise.tv_nsec / 1000};
  return 0;
}

time_t time(time_t* now) noexcept {
  timespec precise = {};
  if (clock_gettime(CLOCK_REALTIME, &precise) != 0) return -1;
  if (now != nullptr) *now = precise.tv_sec;
  return precise.tv_sec;
}
}
