#pragma once

#include <sqlite3.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

namespace scanloc::test {

/// SQLite's file layer, but the process is killed with SIGKILL in the midst of its n-th operation
/// that changes a file: of a write, half the bytes get through. Or the power is cut: of each file
/// there is left what it was when it was last synced, and a file that was deleted is there again
/// unless its folder was synced. For a forked child.
class CrashingVfs {
 public:
  enum class Crash { kKill, kPowerCut };
  static constexpr int kNever = -1;

  /// Makes it what SQLite uses by default. Operation 0 is the first.
  static void Install(int fatal_operation, Crash crash = Crash::kKill) {
    real_ = sqlite3_vfs_find(nullptr);
    operations_left_ = fatal_operation;
    crash_ = crash;
    vfs_ = *real_;
    vfs_.zName = "crashing";
    vfs_.szOsFile = static_cast<int>(sizeof(File)) + real_->szOsFile;
    vfs_.xOpen = Open;
    vfs_.xDelete = Delete;
    sqlite3_vfs_register(&vfs_, 1);
  }

  /// Leaves what a power cut would now leave.
  static void CutPower() {
    for (const auto& [name, content] : durable_) {
      std::ofstream(name, std::ios::binary | std::ios::trunc) << content;
    }
  }

 private:
  struct File {
    sqlite3_file base;
    const char* name;  // SQLite keeps it while the file is open
    sqlite3_file* real;
  };

  static void NoteDurable(const char* name) {
    std::ifstream file(name, std::ios::binary);
    if (crash_ == Crash::kPowerCut && file.is_open()) {
      durable_[name] = std::string(std::istreambuf_iterator<char>(file), {});
    }
  }

  static sqlite3_file* Real(sqlite3_file* file) { return reinterpret_cast<File*>(file)->real; }

  static void CountDown() {
    if (operations_left_-- != 0) return;
    if (crash_ == Crash::kPowerCut) CutPower();
    raise(SIGKILL);
  }

  static int Open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out_flags) {
    auto* own = reinterpret_cast<File*>(file);
    own->name = name != nullptr ? name : "";
    if (!durable_.contains(own->name)) NoteDurable(own->name);
    own->real = reinterpret_cast<sqlite3_file*>(own + 1);
    const int code = real_->xOpen(real_, name, own->real, flags, out_flags);
    own->base.pMethods = own->real->pMethods != nullptr ? &methods_ : nullptr;
    return code;
  }

  static int Delete(sqlite3_vfs*, const char* name, int sync) {
    CountDown();
    if (sync != 0) durable_.erase(name);
    return real_->xDelete(real_, name, sync);
  }

  static int Write(sqlite3_file* file, const void* data, int size, sqlite3_int64 offset) {
    if (operations_left_ == 0) Real(file)->pMethods->xWrite(Real(file), data, size / 2, offset);
    CountDown();
    return Real(file)->pMethods->xWrite(Real(file), data, size, offset);
  }

  static int Truncate(sqlite3_file* file, sqlite3_int64 size) {
    CountDown();
    return Real(file)->pMethods->xTruncate(Real(file), size);
  }

  static int Sync(sqlite3_file* file, int flags) {
    CountDown();
    const int code = Real(file)->pMethods->xSync(Real(file), flags);
    NoteDurable(reinterpret_cast<File*>(file)->name);
    return code;
  }

  inline static sqlite3_vfs* real_ = nullptr;
  inline static sqlite3_vfs vfs_ = {};
  inline static int operations_left_ = 0;
  inline static Crash crash_ = Crash::kKill;
  inline static std::map<std::string, std::string> durable_ = {};
  inline static const sqlite3_io_methods methods_ = {
      .iVersion = 1,
      .xClose = [](sqlite3_file* file) { return Real(file)->pMethods->xClose(Real(file)); },
      .xRead =
          [](sqlite3_file* file, void* data, int size, sqlite3_int64 offset) {
            return Real(file)->pMethods->xRead(Real(file), data, size, offset);
          },
      .xWrite = Write,
      .xTruncate = Truncate,
      .xSync = Sync,
      .xFileSize =
          [](sqlite3_file* file, sqlite3_int64* size) {
            return Real(file)->pMethods->xFileSize(Real(file), size);
          },
      .xLock = [](sqlite3_file* file,
                  int lock) { return Real(file)->pMethods->xLock(Real(file), lock); },
      .xUnlock = [](sqlite3_file* file,
                    int lock) { return Real(file)->pMethods->xUnlock(Real(file), lock); },
      .xCheckReservedLock =
          [](sqlite3_file* file, int* out) {
            return Real(file)->pMethods->xCheckReservedLock(Real(file), out);
          },
      .xFileControl =
          [](sqlite3_file* file, int operation, void* argument) {
            return Real(file)->pMethods->xFileControl(Real(file), operation, argument);
          },
      .xSectorSize =
          [](sqlite3_file* file) { return Real(file)->pMethods->xSectorSize(Real(file)); },
      .xDeviceCharacteristics =
          [](sqlite3_file* file) {
            return Real(file)->pMethods->xDeviceCharacteristics(Real(file));
          },
      .xShmMap = nullptr,
      .xShmLock = nullptr,
      .xShmBarrier = nullptr,
      .xShmUnmap = nullptr,
      .xFetch = nullptr,
      .xUnfetch = nullptr,
  };
};

}  // namespace scanloc::test
