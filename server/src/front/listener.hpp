#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace scanloc::server {

/// Raises the number of files and connections that the process may have open as far as it may.
/// FailedPrecondition: these are fewer than a server needs; gRPC ends the process without them.
[[nodiscard]] absl::Status RaiseDescriptorLimit();

/// What gRPC holds for a connection with nothing on it, and some.
inline constexpr std::int64_t kBytesPerConnection = std::int64_t{64} << 10;

/// How many connections there may be at once, within the memory that they may take [bytes] and what
/// the process may have open.
[[nodiscard]] int MaxConnections(std::int64_t max_memory_bytes);

/// Where the server listens: an address, and all connections that were made to it. It stays
/// while what answers behind it is made anew; who comes meanwhile waits. gRPC 1.51 does not listen
/// again once it has run out of descriptors, and tells of no connection. Thread-safe.
class Listener {
 public:
  /// Gets a connection's socket, to close it some time.
  using Take = std::function<void(int socket)>;

  /// HOST:PORT; port 0 takes a free one. While there are max_connections, the next one takes the
  /// place of one that has long been silent, of the address that has most. InvalidArgument or
  /// Unavailable: cannot listen there.
  [[nodiscard]] static absl::StatusOr<std::unique_ptr<Listener>> Open(const std::string& listen,
                                                                      int max_connections);

  /// HangUp.
  ~Listener();

  /// HOST:PORT as given, with the port that was really taken.
  [[nodiscard]] const std::string& address() const { return address_; }

  /// By which this machine reaches it, HOST a number.
  [[nodiscard]] const std::string& own_address() const { return own_address_; }

  /// Connections go there from now on, on a thread of the listener's.
  void LetIn(Take take);

  /// Lets nobody in until LetIn is called again, and ends every connection.
  void HangUp();

  /// Listens no more. Ends the connections from which nothing has come after `silence`, and after
  /// `latest` all that are left.
  void Close(std::chrono::nanoseconds silence, std::chrono::nanoseconds latest);

  [[nodiscard]] int num_connections() const;

  /// On the connections that there are.
  [[nodiscard]] std::int64_t num_bytes_received() const;

 private:
  struct Connection;
  using Peers = std::map<std::string, std::list<Connection>>;  // of each address, the eldest first

  /// A second descriptor of what was let in: when whoever has the first one ends the connection,
  /// the listener learns of it by this one, which it can end it by, too.
  struct Connection {
    int socket = -1;
    Peers::iterator home;
    std::list<Connection>::iterator self;
    std::uint64_t num_bytes_at_close = 0;  // that had come from the peer
  };

  Listener(std::vector<int> sockets, std::string address, std::string own_address,
           int max_connections);

  using Clock = std::chrono::steady_clock;

  void Run();
  /// All with mutex_ held.
  [[nodiscard]] int Patience_ms() const;  // of the thread, until there is something to do
  void HangUpWhoIsLeft();
  template <typename Condition>
  void HangUpIf(const Condition& condition);
  void Listen(bool shall);
  void Accept(int listening);
  void Add(int socket, const std::string& peer);
  void MakeRoomFor(const std::string& peer);
  void Forget(Connection& connection);

  const std::string address_;
  const std::string own_address_;
  const int max_connections_;
  mutable std::mutex mutex_;
  std::vector<int> sockets_;
  Take take_;
  Peers connections_;
  int num_connections_ = 0;
  bool is_listening_ = false;
  bool is_pausing_ = false;  // there are no descriptors
  Clock::time_point pause_end_;
  /// Of Close.
  Clock::time_point silent_end_ = Clock::time_point::max();
  Clock::time_point all_end_ = Clock::time_point::max();
  bool is_ending_ = false;
  int epoll_ = -1;
  int wake_ = -1;
  std::thread thread_;
};

}  // namespace scanloc::server
