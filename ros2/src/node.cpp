#include "node.hpp"

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "dds_log.hpp"
#include "dds_messages.hpp"
#include "ros_names.hpp"
#include "scanloc/core/status_macros.hpp"
#include "socket_drops.hpp"
#include "unheard.hpp"

namespace scanloc::ros2 {
namespace {

constexpr int kNumOdometry = 256;  // some 0.5 s of a fast one
constexpr int kNumStatic = 64;     // messages, of any number of transforms

absl::Status Failed(const std::string& what, dds_return_t code) {
  return absl::InternalError(absl::StrCat("DDS: ", what, ": ", dds_strretcode(code)));
}

/// The bytes of a message; the sample is given back at their end.
ReceivedBytes Keep(ddsi_serdata* sample) {
  struct Loan {
    ddsi_serdata* sample;
    ddsrt_iovec_t bytes;
    ~Loan() { ddsi_serdata_to_ser_unref(sample, &bytes); }
  };
  auto loan = std::make_shared<Loan>();
  loan->sample = ddsi_serdata_to_ser_ref(sample, 0, ddsi_serdata_size(sample), &loan->bytes);
  ddsi_serdata_unref(sample);
  const std::string_view bytes(static_cast<const char*>(loan->bytes.iov_base), loan->bytes.iov_len);
  return {.bytes = bytes, .owner = std::move(loan)};
}

/// Takes what a reader has, at most kMaxAtOnce messages.
std::vector<ReceivedBytes> Take(dds_entity_t reader) {
  std::vector<ReceivedBytes> taken;
  if (reader <= 0) return taken;
  std::array<ddsi_serdata*, Node::kMaxAtOnce> samples{};
  std::array<dds_sample_info_t, Node::kMaxAtOnce> infos{};
  const dds_return_t num =
      dds_takecdr(reader, samples.data(), samples.size(), infos.data(), DDS_ANY_STATE);
  for (dds_return_t i = 0; i < num; ++i) {
    if (infos[i].valid_data) {
      taken.push_back(Keep(samples[i]));
    } else {
      ddsi_serdata_unref(samples[i]);
    }
  }
  return taken;
}

/// The poses of what a reader has; what is no pose is as if it had not come.
std::vector<dataset::StampedPose> TakePoses(dds_entity_t reader, std::string_view type) {
  std::vector<dataset::StampedPose> taken;
  for (const ReceivedBytes& message : Take(reader)) {
    std::size_t num_bad = 0;
    const auto poses =
        dataset::DecodePoses(type, dataset::WireFormat::kCdr, message.bytes, num_bad);
    if (poses.ok()) taken.insert(taken.end(), poses->begin(), poses->end());
  }
  return taken;
}

using QosPointer = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

QosPointer Qos(bool is_reliable, int depth) {
  QosPointer qos(dds_create_qos(), &dds_delete_qos);
  dds_qset_reliability(qos.get(),
                       is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_MSECS(100));
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, depth);
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  return qos;
}

/// What the user says, after what we do: it goes before ours.
std::string Configuration() {
  // A cloud of megabytes comes as one burst of datagrams, faster than any thread takes them up; the
  // kernel cuts this down to net.core.rmem_max.
  std::string configuration = "<Internal><SocketReceiveBufferSize max=\"32MiB\"/></Internal>";
  const char* const users = std::getenv("CYCLONEDDS_URI");
  if (users != nullptr && *users != '\0') absl::StrAppend(&configuration, ",", users);
  return configuration;
}

}  // namespace

struct Node::Impl {
  ~Impl() { dds_delete(domain); }

  absl::Status Open();
  /// A topic of ROS by its name, or an error.
  absl::StatusOr<dds_entity_t> Topic(const std::string& name, const dds_topic_descriptor_t& type);
  absl::Status Read(const std::string& name, const dds_topic_descriptor_t& type, QosPointer qos,
                    dds_entity_t& reader);
  absl::Status Write(const std::string& name, const dds_topic_descriptor_t& type, int depth,
                     dds_entity_t& writer);
  absl::Status Watch(dds_entity_t entity);
  /// Why messages do not come, or are not heard.
  [[nodiscard]] std::vector<std::string> Problems() const;

  NodeOptions options;
  dds_entity_t domain = 0;
  dds_entity_t participant = 0;
  dds_entity_t waitset = 0;
  dds_entity_t guard = 0;
  dds_entity_t points = 0;
  dds_entity_t odom = 0;
  dds_entity_t tf_static = 0;
  dds_entity_t trigger = 0;
  dds_entity_t initial_pose = 0;
  dds_entity_t pose = 0;
  dds_entity_t candidates = 0;
  dds_entity_t diagnostics = 0;
  dds_entity_t tf = 0;
  dds_entity_t publications = 0;
  std::vector<ReadTopic> read_topics;
};

absl::Status Node::Impl::Watch(dds_entity_t entity) {
  const dds_return_t attached = dds_waitset_attach(waitset, entity, entity);
  return attached < 0 ? Failed("cannot wait for a topic", attached) : absl::OkStatus();
}

absl::StatusOr<dds_entity_t> Node::Impl::Topic(const std::string& name,
                                               const dds_topic_descriptor_t& type) {
  ASSIGN_OR_RETURN(const std::string full, DdsTopicName(options.ros_namespace, name));
  const dds_entity_t topic = dds_create_topic(participant, &type, full.c_str(), nullptr, nullptr);
  if (topic < 0) return Failed(absl::StrCat("no topic ", name), topic);
  return topic;
}

absl::Status Node::Impl::Read(const std::string& name, const dds_topic_descriptor_t& type,
                              QosPointer qos, dds_entity_t& reader) {
  if (name.empty()) return absl::OkStatus();
  ASSIGN_OR_RETURN(const auto topic, Topic(name, type));
  dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
  dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
  (void)dds_qget_reliability(qos.get(), &reliability, nullptr);
  (void)dds_qget_durability(qos.get(), &durability);
  read_topics.push_back(
      {.dds_name = *DdsTopicName(options.ros_namespace, name),
       .dds_type = type.m_typename,
       .is_reliable = reliability == DDS_RELIABILITY_RELIABLE,
       .is_transient_local = durability == DDS_DURABILITY_TRANSIENT_LOCAL,
       .if_best_effort =
           &reader == &points
               ? "the publisher of the clouds is best effort; so must be --reliability"
               : ""});
  reader = dds_create_reader(participant, topic, qos.get(), nullptr);
  if (reader < 0) return Failed(absl::StrCat("no reader of ", name), reader);
  const dds_entity_t has_messages = dds_create_readcondition(reader, DDS_ANY_STATE);
  if (has_messages < 0) return Failed(absl::StrCat("no reader of ", name), has_messages);
  return Watch(has_messages);
}

absl::Status Node::Impl::Write(const std::string& name, const dds_topic_descriptor_t& type,
                               int depth, dds_entity_t& writer) {
  if (name.empty()) return absl::OkStatus();
  ASSIGN_OR_RETURN(const auto topic, Topic(name, type));
  writer = dds_create_writer(participant, topic, Qos(true, depth).get(), nullptr);
  if (writer < 0) return Failed(absl::StrCat("no writer of ", name), writer);
  return absl::OkStatus();
}

absl::Status Node::Impl::Open() {
  domain = dds_create_domain(static_cast<dds_domainid_t>(options.domain), Configuration().c_str());
  if (domain < 0) return Failed("CYCLONEDDS_URI or the network is not as DDS wants it", domain);
  participant =
      dds_create_participant(static_cast<dds_domainid_t>(options.domain), nullptr, nullptr);
  if (participant < 0) {
    return Failed(absl::StrCat("cannot take part in domain ", options.domain), participant);
  }
  waitset = dds_create_waitset(participant);
  guard = dds_create_guardcondition(participant);
  if (waitset < 0 || guard < 0) return Failed("cannot wait", std::min(waitset, guard));
  publications =
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr);
  absl::Status status = Watch(guard);
  // Writers first: who listens is known before there is something to tell.
  status.Update(Write(options.initial_pose, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc,
                      1, initial_pose));
  status.Update(
      Write(options.pose, geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, 10, pose));
  status.Update(Write(options.candidates, geometry_msgs_msg_dds__PoseArray__desc, 10, candidates));
  status.Update(
      Write(options.diagnostics, diagnostic_msgs_msg_dds__DiagnosticArray__desc, 10, diagnostics));
  status.Update(Write(options.tf, tf2_msgs_msg_dds__TFMessage__desc, 100, tf));
  if (status.ok() && initial_pose > 0) {
    dds_set_status_mask(initial_pose, DDS_PUBLICATION_MATCHED_STATUS);
    status.Update(Watch(initial_pose));
  }
  status.Update(Read(options.trigger, std_msgs_msg_dds__Empty__desc, Qos(true, 1), trigger));
  status.Update(
      Read(options.odom, nav_msgs_msg_dds__Odometry__desc, Qos(false, kNumOdometry), odom));
  QosPointer for_ever = Qos(true, kNumStatic);  // what was said before is sent to who comes later
  dds_qset_durability(for_ever.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
  status.Update(
      Read(options.tf_static, tf2_msgs_msg_dds__TFMessage__desc, std::move(for_ever), tf_static));
  status.Update(Read(options.points, sensor_msgs_msg_dds__PointCloud2__desc,
                     Qos(options.is_reliable, options.depth), points));
  return status;
}

absl::StatusOr<std::unique_ptr<Node>> Node::Create(const NodeOptions& options) {
  CatchDdsLog();
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  RETURN_IF_ERROR(impl->Open());
  return std::unique_ptr<Node>(new Node(std::move(impl)));
}

Node::Node(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Node::~Node() = default;

Node::Received Node::Wait(std::chrono::nanoseconds at_most) {
  (void)dds_waitset_wait(impl_->waitset, nullptr, 0, std::max<std::int64_t>(0, at_most.count()));
  bool is_woken = false;
  (void)dds_take_guardcondition(impl_->guard, &is_woken);
  dds_publication_matched_status_t matched;  // so that it counts as seen
  (void)dds_get_publication_matched_status(impl_->initial_pose, &matched);
  Received received{.clouds = Take(impl_->points)};
  received.has_trigger = !Take(impl_->trigger).empty();
  received.odometry = TakePoses(impl_->odom, "nav_msgs/Odometry");
  received.static_transforms = TakePoses(impl_->tf_static, "tf2_msgs/TFMessage");
  return received;
}

void Node::Wake() { (void)dds_set_guardcondition(impl_->guard, true); }

void Node::PublishInitialPose(const PoseMessage& message) {
  const auto dds = ToDds(message);
  (void)dds_write(impl_->initial_pose, &dds);
}

void Node::PublishPose(const PoseMessage& message) {
  const auto dds = ToDds(message);
  (void)dds_write(impl_->pose, &dds);
}

void Node::PublishCandidates(const PosesMessage& message) {
  std::vector<geometry_msgs_msg_dds__Pose_> parts;
  const auto dds = ToDds(message, parts);
  (void)dds_write(impl_->candidates, &dds);
}

void Node::PublishTransform(const TransformMessage& message) {
  geometry_msgs_msg_dds__TransformStamped_ part;
  const auto dds = ToDds(message, part);
  (void)dds_write(impl_->tf, &dds);
}

void Node::Publish(const DiagnosticMessage& message) {
  diagnostic_msgs_msg_dds__DiagnosticStatus_ part;
  std::vector<diagnostic_msgs_msg_dds__KeyValue_> values;
  const auto dds = ToDds(message, part, values);
  (void)dds_write(impl_->diagnostics, &dds);
}

bool Node::Flush(std::chrono::nanoseconds at_most) {
  return dds_wait_for_acks(impl_->initial_pose, at_most.count()) == DDS_RETCODE_OK;
}

std::size_t Node::num_listeners() const {
  dds_publication_matched_status_t matched{};
  (void)dds_get_publication_matched_status(impl_->initial_pose, &matched);
  return matched.current_count;
}

std::vector<std::string> Node::Impl::Problems() const {
  Publishers publishers = LookAtPublishers(publications, read_topics);
  std::vector<std::string> problems = std::move(publishers.problems);
  dds_subscription_matched_status_t matched{};
  (void)dds_get_subscription_matched_status(points, &matched);
  if (matched.current_count == 0 && problems.empty()) {
    const std::vector<std::string>& others = publishers.cloud_topics;
    problems.push_back(absl::StrCat("nobody publishes clouds on ",
                                    DdsTopicName(options.ros_namespace, options.points)->substr(2),
                                    others.empty() ? "" : "; there are clouds on ",
                                    absl::StrJoin(others, ", ")));
  }
  dds_subscription_matched_status_t odometries{};
  (void)dds_get_subscription_matched_status(odom, &odometries);
  if (odometries.current_count > 1) {
    problems.push_back(absl::StrCat(odometries.current_count, " publish odometry on ",
                                    DdsTopicName(options.ros_namespace, options.odom)->substr(2),
                                    "; let one do so"));
  }
  dds_publication_matched_status_t listeners{};
  dds_offered_incompatible_qos_status_t deaf{};
  (void)dds_get_publication_matched_status(initial_pose, &listeners);
  (void)dds_get_offered_incompatible_qos_status(initial_pose, &deaf);
  if (listeners.current_count == 0 && deaf.total_count > 0 &&
      deaf.last_policy_id == DDS_DURABILITY_QOS_POLICY_ID) {
    problems.push_back(absl::StrCat(
        "a subscriber of ", DdsTopicName(options.ros_namespace, options.initial_pose)->substr(2),
        " wants transient local and hears nothing"));
  }
  return problems;
}

Node::Health Node::health() const {
  Health health{.num_malformed = NumMalformed(), .num_dropped_datagrams = NumDroppedDatagrams()};
  dds_subscription_matched_status_t matched{};
  (void)dds_get_subscription_matched_status(impl_->points, &matched);
  health.num_cloud_publishers = matched.current_count;
  std::vector<std::string> problems = impl_->Problems();
  if (matched.current_count > 0 && health.num_dropped_datagrams > 0) {
    problems.push_back(absl::StrCat("the kernel drops datagrams; net.core.rmem_max is ",
                                    LargestReceiveBuffer_bytes(),
                                    ", set it to some clouds' bytes"));
  }
  health.problem = absl::StrJoin(problems, "; ");
  return health;
}

}  // namespace scanloc::ros2
