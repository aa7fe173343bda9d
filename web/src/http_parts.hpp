#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "http_server.hpp"

/// What sessions of the HTTP server share.
namespace scanloc::web {

/// Counts what there may be only so much of. Thread-safe.
class Counted {
 public:
  explicit Counted(std::int64_t most) : most_(most) {}
  [[nodiscard]] bool Take(std::int64_t amount) {
    if (taken_.fetch_add(amount) + amount <= most_) return true;
    taken_ -= amount;
    return false;
  }
  void Give(std::int64_t amount) { taken_ -= amount; }
  [[nodiscard]] std::int64_t taken() const { return taken_; }

 private:
  const std::int64_t most_;
  std::atomic<std::int64_t> taken_ = 0;
};

/// So much of it, for as long as this lives.
class Share {
 public:
  Share() = default;
  ~Share() { Reset(); }
  Share(const Share&) = delete;
  Share& operator=(const Share&) = delete;

  [[nodiscard]] bool Take(Counted& of, std::int64_t amount) {
    Reset();
    if (!of.Take(amount)) return false;
    of_ = &of;
    amount_ = amount;
    return true;
  }
  void Reset() {
    if (of_ != nullptr) of_->Give(amount_);
    of_ = nullptr;
  }

 private:
  Counted* of_ = nullptr;
  std::int64_t amount_ = 0;
};

/// InvalidArgument: not a path with parameters, escaped as URLs are.
[[nodiscard]] absl::Status ParseTarget(std::string_view target, Request* request);

/// The host of a "Host" header, without the port and the brackets of IPv6.
[[nodiscard]] std::string HostOf(std::string_view header);

/// A document that tells what is wrong, as every error does.
[[nodiscard]] Response ErrorResponse(int status, std::string_view code, std::string_view message);

}  // namespace scanloc::web
