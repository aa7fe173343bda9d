#include "ros2/ros_peer.hpp"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <condition_variable>
#include <cstring>
#include <deque>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <map>
#include <mutex>
#include <stdexcept>

namespace scanloc::test {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

DomainLease::DomainLease() {
  constexpr int kFirst = 20;
  constexpr int kLast = 100;  // above, ports run into those of connections
  for (domain_ = kFirst; domain_ <= kLast; ++domain_) {
    const std::string path = "/tmp/scanloc-test-domain-" + std::to_string(domain_);
    fd_ = open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (fd_ >= 0 && flock(fd_, LOCK_EX | LOCK_NB) == 0) return;
    if (fd_ >= 0) close(fd_);
  }
  throw std::runtime_error("every DDS domain for tests is taken");
}

DomainLease::~DomainLease() { close(fd_); }

std::string CycloneOnLoopback() {
  return "CYCLONEDDS_URI=<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/>"
         "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery>"
         "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>9"
         "</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>";
}

namespace {

/// A message as its bytes, whatever they say.
class RawType : public dds::TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 8 << 20;
    m_isGetKeyDefined = false;
  }

  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const std::string*>(data);
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload->data),
                                            payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<std::string*>(data)->size()); };
  }
  void* createData() override { return new std::string(); }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

/// "sensor_msgs/PointCloud2" as rosidl names it to DDS.
std::string DdsType(const std::string& type) {
  const std::size_t slash = type.find('/');
  return type.substr(0, slash) + "::msg::dds_::" + type.substr(slash + 1) + "_";
}

dds::DurabilityQosPolicyKind DdsDurability(RosPeer::Durability durability) {
  return durability == RosPeer::Durability::kVolatile ? dds::VOLATILE_DURABILITY_QOS
                                                      : dds::TRANSIENT_LOCAL_DURABILITY_QOS;
}

struct Matches {
  std::mutex mutex;
  std::condition_variable changed;
  int num = 0;

  void Set(int now) {
    const std::lock_guard lock(mutex);
    num = now;
    changed.notify_all();
  }
  bool Wait() {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, RosPeer::kPatience, [this] { return num > 0; });
  }
};

struct Writing : dds::DataWriterListener {
  void on_publication_matched(dds::DataWriter*,
                              const dds::PublicationMatchedStatus& status) override {
    matches.Set(status.current_count);
  }
  Matches matches;
  dds::DataWriter* writer = nullptr;
};

struct Reading : dds::DataReaderListener {
  void on_subscription_matched(dds::DataReader*,
                               const dds::SubscriptionMatchedStatus& status) override {
    matches.Set(status.current_count);
  }
  void on_data_available(dds::DataReader* reader) override {
    std::string bytes;
    dds::SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      const std::lock_guard lock(mutex);
      messages.push_back(bytes);
      has_message.notify_all();
    }
  }
  Matches matches;
  std::mutex mutex;
  std::condition_variable has_message;
  std::deque<std::string> messages;
};

}  // namespace

struct RosPeer::Impl {
  dds::Topic* Topic(const std::string& name, const std::string& type) {
    dds::TypeSupport support(new RawType(DdsType(type)));
    support.register_type(participant);
    const std::string full = "rt" + name;
    if (auto* known = participant->lookup_topicdescription(full)) {
      return dynamic_cast<dds::Topic*>(known);
    }
    return participant->create_topic(full, support.get_type_name(), dds::TOPIC_QOS_DEFAULT);
  }

  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  dds::Subscriber* subscriber = nullptr;
  std::map<std::string, Writing> writing;
  std::map<std::string, Reading> reading;
};

RosPeer::RosPeer(int domain) : impl_(std::make_unique<Impl>()) {
  dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
  qos.name("scanloc test peer");
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  udp->sendBufferSize = udp->receiveBufferSize = 4 << 20;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  rtps::Locator_t loopback;
  rtps::IPLocator::setIPv4(loopback, 127, 0, 0, 1);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.initialPeersList.push_back(loopback);
  builtin.metatrafficUnicastLocatorList.push_back(loopback);
  builtin.discovery_config.leaseDuration_announcementperiod = {0, 200'000'000};
  qos.wire_protocol().default_unicast_locator_list.push_back(loopback);
  impl_->participant = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<dds::DomainId_t>(domain), qos);
  if (impl_->participant == nullptr) throw std::runtime_error("Fast DDS does not start");
  impl_->publisher = impl_->participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  impl_->subscriber = impl_->participant->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
}

RosPeer::~RosPeer() {
  impl_->participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(impl_->participant);
}

void RosPeer::Advertise(const std::string& topic, const std::string& type, Reliability reliability,
                        Durability durability) {
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  qos.reliability().kind = reliability == Reliability::kReliable ? dds::RELIABLE_RELIABILITY_QOS
                                                                 : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.durability().kind = DdsDurability(durability);
  qos.history().depth = 10;
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;  // large ones go in fragments
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  Writing& writing = impl_->writing[topic];
  writing.writer = impl_->publisher->create_datawriter(impl_->Topic(topic, type), qos, &writing);
  if (writing.writer == nullptr) throw std::runtime_error("no writer of " + topic);
}

void RosPeer::Subscribe(const std::string& topic, const std::string& type, Durability durability) {
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.durability().kind = DdsDurability(durability);
  qos.history().depth = 100;
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  Reading& reading = impl_->reading[topic];
  if (impl_->subscriber->create_datareader(impl_->Topic(topic, type), qos, &reading) == nullptr) {
    throw std::runtime_error("no reader of " + topic);
  }
}

bool RosPeer::WaitForReader(const std::string& topic) {
  return impl_->writing.at(topic).matches.Wait();
}

bool RosPeer::WaitForWriter(const std::string& topic) {
  return impl_->reading.at(topic).matches.Wait();
}

bool RosPeer::Publish(const std::string& topic, const std::string& bytes) {
  std::string copy = bytes;
  return impl_->writing.at(topic).writer->write(&copy);
}

std::optional<std::string> RosPeer::Next(const std::string& topic,
                                         std::chrono::milliseconds within) {
  Reading& reading = impl_->reading.at(topic);
  std::unique_lock lock(reading.mutex);
  if (!reading.has_message.wait_for(lock, within, [&] { return !reading.messages.empty(); })) {
    return std::nullopt;
  }
  std::string bytes = std::move(reading.messages.front());
  reading.messages.pop_front();
  return bytes;
}

}  // namespace scanloc::test
