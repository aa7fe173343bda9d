#include "scanloc/catalogue/store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>

#include "absl/strings/str_cat.h"
#include "support/file_size_limit.hpp"
#include "support/paths.hpp"
#include "support/process.hpp"
#include "support/temp_dir.hpp"

namespace scanloc::catalogue {
namespace {

namespace fs = std::filesystem;

const auto kGoOn = [] { return true; };

/// A folder, by its path and through a web server.
class StoreTest : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    if (!GetParam()) return;
    server_ = std::make_unique<test::Process>(std::vector<std::string>{
        "/usr/bin/python3", test::SourceDir() + "/tests/support/web_store.py", folder_});
    port_ = server_->ReadLine();
    ASSERT_FALSE(port_.empty());
  }
  [[nodiscard]] std::unique_ptr<Store> Open(const StoreOptions& options = {}) const {
    auto store = OpenStore(server_ ? "http://127.0.0.1:" + port_ : folder_, options);
    EXPECT_TRUE(store.ok()) << store.status();
    return *std::move(store);
  }

  test::TempDir dir_;
  std::string folder_ = dir_.File("store");
  std::unique_ptr<test::Process> server_;
  std::string port_;
};

TEST_P(StoreTest, GivesWhatItWasGiven) {
  std::string bytes(3'000'000, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i >> 3);
  const std::string path = dir_.Write("file", bytes);
  const auto store = Open();
  ASSERT_TRUE(store->Put("name", path).ok());
  const absl::Status got = store->Get("name", dir_.File("copy"), 3'000'000, kGoOn);
  ASSERT_TRUE(got.ok()) << got;
  EXPECT_EQ(test::ReadFile(dir_.File("copy")), bytes);
  EXPECT_EQ(*Sha256OfFile(dir_.File("copy")), *Sha256OfFile(path));
}

TEST_P(StoreTest, MendsWhatItHadDamaged) {
  const std::string path = dir_.Write("file", "as it was published");
  std::ofstream(folder_ + "/name") << "cut";
  const auto store = Open();
  ASSERT_TRUE(store->Put("name", path).ok());
  ASSERT_TRUE(store->Get("name", dir_.File("copy"), 1000, kGoOn).ok());
  EXPECT_EQ(test::ReadFile(dir_.File("copy")), "as it was published");
}

TEST_P(StoreTest, IsGivenNothingThatItHas) {
  const std::string path = dir_.Write("file", "the map");
  const auto store = Open();
  ASSERT_TRUE(store->Put("name", path).ok());
  const fs::file_time_type long_ago = fs::last_write_time(path) - std::chrono::hours(1000);
  fs::last_write_time(folder_ + "/name", long_ago);
  ASSERT_TRUE(store->Put("name", path).ok());
  EXPECT_EQ(fs::last_write_time(folder_ + "/name"), long_ago);
}

TEST_P(StoreTest, RefusesWhatIsNotThereOrTooLong) {
  const auto store = Open();
  EXPECT_EQ(store->Get("none", dir_.File("copy"), 100, kGoOn).code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(store->Put("name", dir_.Write("file", std::string(1000, 'x'))).ok());
  EXPECT_EQ(store->Get("name", dir_.File("copy"), 999, kGoOn).code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(store->Get("name", dir_.File("no/folder/copy"), 1000, kGoOn).ok());
  EXPECT_FALSE(store->Put("other", dir_.File("none")).ok());
}

TEST_P(StoreTest, StopsWhenNobodyWantsIt) {
  const auto store = Open();
  ASSERT_TRUE(store->Put("name", dir_.Write("file", std::string(1000, 'x'))).ok());
  EXPECT_EQ(store->Get("name", dir_.File("copy"), 1000, [] { return false; }).code(),
            absl::StatusCode::kCancelled);
}

INSTANTIATE_TEST_SUITE_P(Of, StoreTest, testing::Bool(), [](const auto& test) {
  return std::string(test.param ? "AWebServer" : "AFolder");
});

class WebStoreTest : public StoreTest {};

TEST_P(WebStoreTest, IsGivenUpWhenItIsAwayOrTooSlow) {
  const auto store = Open({.connect_s = 2.0, .least_bytes_per_s = 1000, .slow_s = 1.0});
  ASSERT_TRUE(store->Put("name", dir_.Write("file", std::string(1000, 'x'))).ok());
  dir_.Write("store/slow", "");
  EXPECT_EQ(store->Get("name", dir_.File("copy"), 1000, kGoOn).code(),
            absl::StatusCode::kUnavailable);
  fs::remove(folder_ + "/slow");
  EXPECT_TRUE(store->Get("name", dir_.File("copy"), 1000, kGoOn).ok());
  server_->Signal(SIGKILL);
  server_->Wait();
  EXPECT_EQ(store->Get("name", dir_.File("copy"), 1000, kGoOn).code(),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(store->Put("name", dir_.File("file")).code(), absl::StatusCode::kUnavailable);
}

// An answer that is no error to a browser: what it holds is not the file, and nothing was stored.
TEST_P(WebStoreTest, TakesNoOtherAnswerForTheFileOrForItsReceipt) {
  const auto store = Open();
  const std::string path = dir_.Write("file", std::string(1000, 'x'));
  ASSERT_TRUE(store->Put("name", path).ok());
  for (const char* const status : {"301", "307", "206", "202"}) {
    dir_.Write("store/status", status);
    const absl::Status got = store->Get("name", dir_.File("copy"), 1000, kGoOn);
    EXPECT_EQ(got.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_THAT(got.message(), testing::HasSubstr(absl::StrCat("status ", status)));
    const absl::Status put = store->Put("name", path);
    EXPECT_EQ(put.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_THAT(put.message(), testing::HasSubstr(absl::StrCat("status ", status)));
  }
}

INSTANTIATE_TEST_SUITE_P(Of, WebStoreTest, testing::Values(true));

TEST(S3Store, GivesWhatItWasGivenToWhoeverSignsWithItsSecret) {
  const test::TempDir dir;
  test::Process server(
      {"/usr/bin/python3", test::SourceDir() + "/tests/support/s3_server.py", dir.File("")});
  const std::string url = "s3://maps/eu?endpoint=http://127.0.0.1:" + server.ReadLine();
  setenv("AWS_ACCESS_KEY_ID", "test:robot", 1);
  setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
  const auto store = *OpenStore(url);
  const std::string bytes = std::string(1'000'000, 'x') + '\0' + std::string(1'000'000, 'y');
  const absl::Status put = store->Put("name", dir.Write("file", bytes));
  ASSERT_TRUE(put.ok()) << put;
  const absl::Status got = store->Get("name", dir.File("copy"), 3'000'000, kGoOn);
  ASSERT_TRUE(got.ok()) << got;
  EXPECT_EQ(test::ReadFile(dir.File("copy")), bytes);
  const auto versions = [&] {
    std::set<std::string> names;  // with the time of each upload
    for (const auto& entry : fs::recursive_directory_iterator(dir.File("disk/objects"))) {
      if (entry.path().extension() == ".data") names.insert(entry.path().filename());
    }
    return names;
  };
  const std::set<std::string> before = versions();
  EXPECT_EQ(before.size(), 1U);
  EXPECT_TRUE(store->Put("name", dir.File("file")).ok());
  EXPECT_EQ(versions(), before) << "it has it";
  EXPECT_EQ(store->Get("none", dir.File("copy"), 100, kGoOn).code(), absl::StatusCode::kNotFound);

  setenv("AWS_SECRET_ACCESS_KEY", "other", 1);
  const auto stranger = *OpenStore(url);
  EXPECT_THAT(stranger->Get("name", dir.File("copy"), 3'000'000, kGoOn).message(),
              testing::HasSubstr("status 403"));
  EXPECT_THAT(stranger->Put("other", dir.File("file")).message(), testing::HasSubstr("status 403"));
}

TEST(FolderStore, DoesNotWaitForWhatIsNoFile) {
  const test::TempDir dir;
  const auto store = *OpenStore(dir.File("store"));
  ASSERT_EQ(mkfifo(dir.File("store/name").c_str(), 0600), 0);
  const absl::Status got = store->Get("name", dir.File("copy"), 100, kGoOn);
  EXPECT_EQ(got.code(), absl::StatusCode::kDataLoss) << got;
}

TEST(FolderStore, RemovesWhatKilledPublishersLeftLongAgo) {
  const test::TempDir dir;
  const std::string path = dir.Write("file", "the map");
  for (const char* name : {"a.scanloc.part-1", "b.scanloc.part-1", "c.scanloc"}) {
    dir.Write(absl::StrCat("store/", name), "half");
  }
  const auto day = std::chrono::hours(24);
  for (const char* name : {"store/b.scanloc.part-1", "store/c.scanloc"}) {
    fs::last_write_time(dir.File(name), fs::last_write_time(path) - 2 * day);
  }
  ASSERT_TRUE((*OpenStore(dir.File("store")))->Put("d.scanloc", path).ok());
  EXPECT_TRUE(fs::exists(dir.File("store/a.scanloc.part-1"))) << "may be under way";
  EXPECT_FALSE(fs::exists(dir.File("store/b.scanloc.part-1")));
  EXPECT_TRUE(fs::exists(dir.File("store/c.scanloc")));
}

TEST(FolderStore, TellsThatTheDiskIsFull) {
  const test::TempDir dir;
  auto store = *OpenStore(dir.File("store"));
  ASSERT_TRUE(store->Put("name", dir.Write("file", std::string(1000, 'x'))).ok());
  EXPECT_EQ(store->Get("name", "/dev/full", 1000, kGoOn).code(),
            absl::StatusCode::kResourceExhausted);
}

TEST(FolderStore, SaysWhyAFileHadRoomForAPartAlone) {
  const test::TempDir dir;
  const std::string path = dir.Write("file", std::string(100'000, 'x'));
  auto store = *OpenStore(dir.File("store"));
  absl::Status status;
  {
    const test::FileSizeLimit limit(60'000);
    status = store->Put("name", path);
  }
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(status.message(), testing::HasSubstr("File too large"));
  EXPECT_TRUE(fs::is_empty(dir.File("store")));
}

TEST(OpenStore, RefusesWhatIsNone) {
  EXPECT_EQ(OpenStore("").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(OpenStore("ftp://host/maps").status().code(), absl::StatusCode::kInvalidArgument);
  unsetenv("AWS_ACCESS_KEY_ID");
  EXPECT_EQ(OpenStore("s3://bucket/maps").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Sha256OfFile, IsTheOneOfTheStandard) {
  const test::TempDir dir;
  EXPECT_EQ(*Sha256OfFile(dir.Write("abc", "abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace scanloc::catalogue
