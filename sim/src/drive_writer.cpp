#include "scanloc/sim/drive_writer.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "absl/strings/str_cat.h"
#include "poses.hpp"
#include "scanloc/core/status_macros.hpp"
#include "scanloc/jobs/jobs.hpp"
#include "sim_text.hpp"

namespace scanloc::sim {
namespace {

namespace fs = std::filesystem;

absl::Status CannotWrite(const fs::path& path, int error) {
  const std::string message =
      absl::StrCat("cannot write ", path.string(), ": ",
                   std::error_code(error, std::generic_category()).message());
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    return absl::ResourceExhaustedError(absl::StrCat(message, "; free some space and try again"));
  }
  if (error == EACCES || error == EPERM || error == EROFS) {
    return absl::PermissionDeniedError(absl::StrCat(message, "; choose another folder"));
  }
  return absl::UnavailableError(message);
}

absl::Status WriteFile(const fs::path& path, const void* data, std::size_t num_bytes) {
  std::FILE* file = std::fopen(path.c_str(), "wbx");
  if (file == nullptr) return CannotWrite(path, errno);
  const bool written = std::fwrite(data, 1, num_bytes, file) == num_bytes;
  const int write_error = errno;
  // A full disk may show only when the buffers are emptied.
  const bool closed = std::fclose(file) == 0;
  if (!written) return CannotWrite(path, write_error);
  if (!closed) return CannotWrite(path, errno);
  return absl::OkStatus();
}

absl::Status WriteFile(const fs::path& path, std::string_view text) {
  return WriteFile(path, text.data(), text.size());
}

std::vector<Pose> PosesOf(const SimulatedDrive& drive) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < drive.size(); ++i) poses.push_back(drive.T_map_sensor(i));
  return poses;
}

std::string PoseRows(const std::vector<Pose>& poses) {
  std::string text;
  for (const Pose& pose : poses) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        text += NumberText(pose.matrix()(row, column));
        text += row == 2 && column == 3 ? '\n' : ' ';
      }
    }
  }
  return text;
}

std::string TimeRows(const SimulatedDrive& drive) {
  std::string text;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    text += NumberText(static_cast<double>(drive.stamp_ns(i)) * 1e-9) + '\n';
  }
  return text;
}

/// How far each scan was taken from the nearest street that was rebuilt [m].
std::string RebuiltRows(const SimulatedDrive& drive) {
  std::string text;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const Eigen::Vector2d at = drive.T_map_sensor(i).translation().head<2>();
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const Path& street : drive.town().rebuilt) {
      for (const Eigen::Vector2d& point : street.points()) {
        nearest_m = std::min(nearest_m, (point - at).norm());
      }
    }
    text += NumberText(nearest_m) + '\n';
  }
  return text;
}

absl::Status WriteScan(const SimulatedDrive& drive, std::size_t i, const fs::path& folder) {
  const PointCloud scan = drive.Scan(i);
  std::vector<std::array<float, 4>> rows;
  rows.reserve(scan.size());
  for (const Point& point : scan) rows.push_back({point.x, point.y, point.z, 0.0F});
  std::string name = std::to_string(i);
  if (name.size() < 6) name.insert(0, 6 - name.size(), '0');
  return WriteFile(folder / (name + ".bin"), rows.data(), rows.size() * sizeof(rows[0]));
}

absl::Status MakeFolders(const fs::path& out, const fs::path& scans) {
  std::error_code error;
  const fs::file_status status = fs::status(out, error);
  if (fs::exists(status)) {
    const bool usable = fs::is_directory(status) && fs::is_empty(out, error);
    if (error) return CannotWrite(out, error.value());
    if (!usable) {
      return absl::AlreadyExistsError(absl::StrCat(
          out.string(), " exists and is not an empty folder; choose another or delete it"));
    }
  }
  fs::create_directories(scans, error);
  if (error) return CannotWrite(scans, error.value());
  return absl::OkStatus();
}

}  // namespace

absl::Status WriteDrive(const SimulatedDrive& drive, const fs::path& out, int num_threads,
                        const DriveProgress& progress) {
  RETURN_IF_ERROR(CheckRange("num_threads", num_threads, 1, 256));
  const fs::path scans = out / "velodyne";
  RETURN_IF_ERROR(MakeFolders(out, scans));
  RETURN_IF_ERROR(WriteFile(out / "simulation.txt", Describe(drive.options())));
  RETURN_IF_ERROR(WriteFile(out / "times.txt", TimeRows(drive)));
  const auto write = [&](std::size_t i, std::size_t /*worker*/) {
    return WriteScan(drive, i, scans);
  };
  const auto tell = [&](std::size_t num_done) {
    if (progress) progress(num_done, drive.size());
  };
  RETURN_IF_ERROR(RunJobs(NumThreads(num_threads), drive.size(), write, tell));
  const std::vector<Pose> poses = PosesOf(drive);
  const SessionOptions& session = drive.options().session;
  if (session.odometry_noise_percent > 0.0) {
    const std::vector<Pose> reckoned =
        Reckon(poses, session.odometry_noise_percent, session.session_seed);
    RETURN_IF_ERROR(WriteFile(out / "odometry.txt", PoseRows(reckoned)));
  }
  if (!drive.town().rebuilt.empty()) {
    RETURN_IF_ERROR(WriteFile(out / "rebuilt.txt", RebuiltRows(drive)));
  }
  return WriteFile(out / "poses.txt", PoseRows(poses));
}

absl::Status Simulate(const SimulateOptions& options, const fs::path& out, int num_threads,
                      const DriveProgress& progress) {
  ASSIGN_OR_RETURN(SimulatedDrive drive, SimulatedDrive::Create(options));
  return WriteDrive(drive, out, num_threads, progress);
}

}  // namespace scanloc::sim
