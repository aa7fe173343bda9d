// Builds that are killed, run out of room, or may not write: what was committed stays, and --resume
// ends in the content of an unbroken build.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <iostream>
#include <set>

#include "absl/strings/match.h"
#include "scanloc/mapdb/build_map.hpp"
#include "scanloc/mapdb/map_file.hpp"
#include "scanloc/mapdb/merge_maps.hpp"
#include "support/child_process.hpp"
#include "support/crashing_vfs.hpp"
#include "support/small_maps.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::mapdb {
namespace {

using test::SmallLoader;
using test::SmallOptions;
using test::SmallPlan;

constexpr std::size_t kNumScans = 8;

// Whether SQLite has to roll it back: its header, written last, counts pages from byte 8 on.
bool IsHotJournal(const std::string& path) {
  if (!std::filesystem::exists(path)) return false;
  const std::string bytes = test::ReadFile(path);
  return bytes.size() > 1000 && bytes.substr(8, 4) != std::string(4, '\0');
}

class KilledBuild : public testing::Test {
 protected:
  void SetUp() override {
    const auto unbroken = test::BuildSmallMap(dir_.File("unbroken"), kNumScans);
    ASSERT_TRUE(unbroken.ok()) << unbroken.status();
    content_id_ = unbroken->content_id;
  }

  // Builds the whole map in this process.
  absl::StatusOr<BuildSummary> Build(const ScanLoader& load_scan = SmallLoader(),
                                     const ProgressCallback& progress = nullptr) const {
    return BuildMap(SmallOptions(path_, BuildMode::kResume), SmallPlan("one", kNumScans), load_scan,
                    progress);
  }

  // Read, the file is what some commit left, or refused and left alone because a write has to be
  // undone first; resumed it becomes the whole map.
  void ExpectResumes() {
    ExpectReadingLeavesEverythingAlone();
    auto map = LoadMap(path_);
    if (absl::IsFailedPrecondition(map.status())) {
      ++num_refused_;
      // To tell what commit it was, a copy is recovered.
      const test::TempDir copy;
      const std::string copied = copy.Write("copy", test::ReadFile(path_));
      copy.Write("copy-journal", test::ReadFile(path_ + "-journal"));
      EXPECT_TRUE(RecoverMap(copied).ok());
      map = LoadMap(copied);
      if (map.ok()) {
        EXPECT_TRUE(FindProblems(copied)->empty());
      }
    }
    const bool is_before_first_commit =
        !std::filesystem::exists(path_) || absl::IsInvalidArgument(map.status());
    EXPECT_TRUE(map.ok() || is_before_first_commit) << map.status();
    if (map.ok()) num_places_found_.insert(map->places.size());
    const auto resumed = Build();
    ASSERT_TRUE(resumed.ok()) << resumed.status();
    EXPECT_EQ(resumed->content_id, content_id_);
    EXPECT_FALSE(std::filesystem::exists(path_ + "-journal"));
  }

  void ExpectReadingLeavesEverythingAlone() {
    const auto bytes = [&](const std::string& path) {
      return std::filesystem::exists(path) ? test::ReadFile(path) : "none";
    };
    const std::string map = bytes(path_);
    const std::string journal = bytes(path_ + "-journal");
    const auto loaded = LoadMap(path_);
    EXPECT_EQ(loaded.ok(), ReadInfo(path_).ok());
    const auto problems = FindProblems(path_);
    EXPECT_EQ(loaded.ok(), problems.ok() && problems->empty());
    (void)ReadPlaces(path_);
    (void)MergeMaps(dir_.File("merged"), {path_});
    std::filesystem::remove(dir_.File("merged"));
    EXPECT_TRUE(bytes(path_) == map) << "the map was written";
    EXPECT_TRUE(bytes(path_ + "-journal") == journal) << "the journal was written";
  }

  [[nodiscard]] bool IsSoundWithoutJournal() const {
    const test::TempDir copy;
    const auto problems = FindProblems(copy.Write("copy", test::ReadFile(path_)));
    return problems.ok() && problems->empty();
  }

  // Kills builds at later and later writes until a journal is left beside a half-written file.
  void LeaveHotJournal() {
    int operation = 60;
    do {
      Remove();
      ASSERT_EQ(test::RunInChild([&] {
                  test::CrashingVfs::Install(operation);
                  return Build().ok() ? 0 : 1;
                }),
                -SIGKILL);
      ++operation;
    } while (!IsHotJournal(path_ + "-journal") || IsSoundWithoutJournal());
  }

  void Remove() const {
    std::filesystem::remove(path_);
    std::filesystem::remove(path_ + "-journal");
  }

  test::TempDir dir_;
  std::string path_ = dir_.File("a.scanloc");
  std::string content_id_;
  std::set<std::size_t> num_places_found_;
  int num_refused_ = 0;
};

TEST_F(KilledBuild, ResumesWhateverScanItWasKilledAt) {
  for (std::size_t last = 0; last < kNumScans; ++last) {
    SCOPED_TRACE(last);
    const int status = test::RunInChild([&] {
      const auto summary = Build([&](std::size_t scan) {
        if (scan == last) raise(SIGKILL);
        return SmallLoader()(scan);
      });
      return summary.ok() ? 0 : 1;
    });
    EXPECT_EQ(status, -SIGKILL);
    ExpectResumes();
    Remove();
  }
}

TEST_F(KilledBuild, ResumesWhateverWriteItWasKilledOrThePowerCutIn) {
  using Crash = test::CrashingVfs::Crash;
  int num_journals = 0;
  for (const Crash crash : {Crash::kKill, Crash::kPowerCut}) {
    bool is_killed = true;
    for (int operation = 0; is_killed; ++operation) {
      SCOPED_TRACE(operation);
      ASSERT_LT(operation, 2000);
      const int status = test::RunInChild([&] {
        test::CrashingVfs::Install(operation, crash);
        return Build().ok() ? 0 : 1;
      });
      is_killed = status == -SIGKILL;
      EXPECT_TRUE(is_killed || status == 0) << status;
      num_journals += std::filesystem::exists(path_ + "-journal") ? 1 : 0;
      ExpectResumes();
      if (HasFailure()) return;
      Remove();
    }
  }
  EXPECT_GT(num_journals, 20);
  EXPECT_GT(num_refused_, 10);
  EXPECT_EQ(num_places_found_, (std::set<std::size_t>{0, 3, 6, 8}));
}

TEST_F(KilledBuild, HoldsThroughAPowerCutOnceItIsBuilt) {
  ASSERT_EQ(test::RunInChild([&] {
              test::CrashingVfs::Install(test::CrashingVfs::kNever,
                                         test::CrashingVfs::Crash::kPowerCut);
              if (!Build().ok()) return 1;
              test::CrashingVfs::CutPower();
              return 0;
            }),
            0);
  const auto map = LoadMap(path_);
  ASSERT_TRUE(map.ok()) << map.status();
  EXPECT_EQ(map->places.size(), kNumScans);
}

TEST_F(KilledBuild, ResumesAnAppendedSessionKilledInAnyWrite) {
  const std::string base = test::ReadFile(dir_.File("unbroken"));
  const auto append = [&](BuildMode mode) {
    return BuildMap(SmallOptions(path_, mode), SmallPlan("two", 3), SmallLoader(70));
  };
  dir_.Write("a.scanloc", base);
  const auto unbroken = append(BuildMode::kAppend);
  ASSERT_TRUE(unbroken.ok()) << unbroken.status();
  bool is_killed = true;
  for (int operation = 0; is_killed; ++operation) {
    SCOPED_TRACE(operation);
    Remove();
    dir_.Write("a.scanloc", base);
    const int status = test::RunInChild([&] {
      test::CrashingVfs::Install(operation);
      return append(BuildMode::kAppend).ok() ? 0 : 1;
    });
    is_killed = status == -SIGKILL;
    EXPECT_TRUE(is_killed || status == 0) << status;
    ASSERT_TRUE(RecoverMap(path_).ok());
    const auto map = LoadMap(path_);
    ASSERT_TRUE(map.ok()) << map.status();
    EXPECT_GE(map->places.size(), kNumScans);
    const bool has_session = map->sessions.size() == 2;
    const auto resumed = append(has_session ? BuildMode::kResume : BuildMode::kAppend);
    ASSERT_TRUE(resumed.ok()) << resumed.status();
    EXPECT_EQ(resumed->content_id, unbroken->content_id);
  }
}

// Gives up root's right to write everywhere.
void BecomeNobody() {
  if (geteuid() == 0 && setresuid(65534, 65534, 65534) != 0) _exit(3);
}

// Prints the status of a child that did not expect it.
int Report(bool is_expected, const absl::Status& status) {
  if (!is_expected) std::cerr << "unexpected: " << status << '\n';
  return is_expected ? 0 : 1;
}

class ReadOnlyMap : public KilledBuild {
 protected:
  // Nobody may write the map or its folder.
  void MakeReadOnly() const {
    for (const auto& entry : std::filesystem::directory_iterator(dir_.path())) {
      ASSERT_EQ(chmod(entry.path().c_str(), 0444), 0);
    }
    ASSERT_EQ(chmod(dir_.path().c_str(), 0555), 0);
  }
  void TearDown() override { chmod(dir_.path().c_str(), 0755); }
};

TEST_F(ReadOnlyMap, IsReadInAFolderThatCannotBeWritten) {
  ASSERT_TRUE(Build().ok());
  MakeReadOnly();
  EXPECT_EQ(test::RunInChild([&] {
              BecomeNobody();
              const auto map = LoadMap(path_);
              const auto problems = FindProblems(path_);
              return Report(map.ok() && ReadInfo(path_).ok() && problems.ok() && problems->empty(),
                            map.status());
            }),
            0);
}

TEST_F(ReadOnlyMap, IsNotAppendedTo) {
  ASSERT_TRUE(Build().ok());
  MakeReadOnly();
  EXPECT_EQ(test::RunInChild([&] {
              BecomeNobody();
              const absl::Status status = MapBuilder::Append(path_, SmallPlan("two", 1)).status();
              return Report(absl::IsPermissionDenied(status), status);
            }),
            0);
}

TEST_F(KilledBuild, IsReadOnlyAfterItsWriteWasUndoneInSoManyWords) {
  LeaveHotJournal();
  for (const absl::Status& refused :
       {LoadMap(path_).status(), ReadInfo(path_).status(), FindProblems(path_).status(),
        ReadPlaces(path_).status(), MergeMaps(dir_.File("merged"), {path_}).status(),
        MapBuilder::Append(path_, SmallPlan("two", 1)).status()}) {
    EXPECT_TRUE(absl::IsFailedPrecondition(refused)) << refused;
    EXPECT_TRUE(absl::StrContains(refused.message(), path_ + "-journal")) << refused;
    EXPECT_TRUE(absl::StrContains(refused.message(), "--recover")) << refused;
  }
  ExpectReadingLeavesEverythingAlone();
  EXPECT_EQ(RecoverMap(path_).value(), Recovery::kRolledBack);
  EXPECT_EQ(RecoverMap(path_).value(), Recovery::kNothingToDo);
  EXPECT_TRUE(LoadMap(path_).ok());
  EXPECT_TRUE(FindProblems(path_)->empty());
}

TEST_F(KilledBuild, HasNoPowerOverTheMapThatTakesItsPlace) {
  // That of the same drive is the worst: its first places are those of the killed build's.
  for (const std::string session : {"one", "other"}) {
    SCOPED_TRACE(session);
    LeaveHotJournal();
    const std::string next = dir_.File("next");
    ASSERT_TRUE(BuildMap(SmallOptions(next, BuildMode::kCreate), SmallPlan(session, kNumScans),
                         SmallLoader())
                    .ok());
    const std::string map = test::ReadFile(next);
    std::filesystem::rename(next, path_);
    EXPECT_TRUE(absl::IsFailedPrecondition(LoadMap(path_).status()));
    ExpectReadingLeavesEverythingAlone();
    EXPECT_EQ(RecoverMap(path_).value(), Recovery::kJournalRemoved);
    EXPECT_TRUE(test::ReadFile(path_) == map);
    const auto loaded = LoadMap(path_);
    ASSERT_TRUE(loaded.ok()) << loaded.status();
    EXPECT_EQ(loaded->places.size(), kNumScans);
  }
}

TEST_F(ReadOnlyMap, IsRefusedWithTheUnfinishedWriteOfAKilledBuild) {
  LeaveHotJournal();
  MakeReadOnly();
  EXPECT_EQ(test::RunInChild([&] {
              BecomeNobody();
              const absl::Status status = LoadMap(path_).status();
              const bool is_clear = absl::StrContains(status.message(), "unfinished write");
              const absl::Status recovery = RecoverMap(path_).status();
              return Report(absl::IsFailedPrecondition(status) && is_clear &&
                                absl::IsPermissionDenied(recovery),
                            recovery);
            }),
            0);
}

TEST_F(KilledBuild, ResumesAfterTheDiskWasFull) {
  constexpr rlim_t kPageBytes = 8192;
  int num_full = 0;
  bool is_full = true;
  for (rlim_t room = 0; is_full; room += kPageBytes / 2) {
    SCOPED_TRACE(room);
    ASSERT_LT(room, 100 * kPageBytes);
    const int status = test::RunInChild([&] {
      signal(SIGXFSZ, SIG_IGN);
      const rlimit limit = {room, room};
      setrlimit(RLIMIT_FSIZE, &limit);
      const absl::Status result = Build().status();
      if (result.ok()) return 0;
      const bool is_clear = absl::StrContains(result.message(), "--resume");
      return absl::IsResourceExhausted(result) && is_clear ? 10 : Report(false, result);
    });
    is_full = status == 10;
    EXPECT_TRUE(is_full || status == 0) << status;
    num_full += is_full ? 1 : 0;
    ExpectResumes();
    Remove();
  }
  EXPECT_GT(num_full, 5);
}

}  // namespace
}  // namespace scanloc::mapdb
