// Reads a topic as a node of ROS 2 does, by eProsima Fast DDS, which is not the implementation that
// posed sends with: messages are decoded here from their bytes. Prints a line of JSON for the
// writer that it finds and for each sample.
//
// usage: posed_ros2_reader DOMAIN TOPIC JointState|JointTrajectory|TFMessage [LIFESPAN_MS]
#include <cstdint>
#include <cstring>
#include <ctime>
#include <iostream>
#include <string>
#include <vector>

#include <unistd.h>

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <nlohmann/json.hpp>

namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Json = nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;

std::int64_t wall_ns() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

void print(const Json& line) { std::cout << line.dump() << std::endl; }

// Plain CDR, little-endian, as its four first bytes say.
class Cdr {
 public:
  explicit Cdr(const Bytes& bytes) : bytes_(bytes) {
    if (bytes.size() < 4 || bytes[0] != 0 || bytes[1] != 1) throw std::runtime_error("encoding");
  }
  template <typename T>
  T number() {
    at_ = (at_ + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    T value{};
    std::memcpy(&value, take(sizeof(T)), sizeof(T));
    return value;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();
    const char* begin = reinterpret_cast<const char*>(take(size));
    if (size == 0 || begin[size - 1] != 0) throw std::runtime_error("text without its end");
    return {begin, size - 1};
  }
  template <typename Read>
  Json list(Read&& read) {
    Json all = Json::array();
    const auto size = number<std::uint32_t>();
    for (std::uint32_t i = 0; i < size; ++i) all.push_back(read());
    return all;
  }
  Json texts() {
    return list([this] { return text(); });
  }
  Json numbers() {
    return list([this] { return number<double>(); });
  }
  std::int64_t time_ns() {
    const auto s = number<std::int32_t>();
    return s * 1'000'000'000LL + number<std::uint32_t>();
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - 4 - at_; }

 private:
  const std::uint8_t* take(std::size_t size) {
    if (size > left()) throw std::runtime_error("cut");
    at_ += size;
    return bytes_.data() + 4 + at_ - size;
  }
  const Bytes& bytes_;
  std::size_t at_ = 0;
};

Json header_of(Cdr& cdr) {
  const std::int64_t stamp_ns = cdr.time_ns();
  return {{"stamp_ns", stamp_ns}, {"age_ns", wall_ns() - stamp_ns}, {"frame_id", cdr.text()}};
}

Json joint_state(Cdr& cdr) {
  Json line = header_of(cdr);
  line["name"] = cdr.texts();
  for (const char* key : {"position", "velocity", "effort"}) line[key] = cdr.numbers();
  return line;
}

Json trajectory(Cdr& cdr) {
  Json line = header_of(cdr);
  line["name"] = cdr.texts();
  line["points"] = cdr.list([&] {
    Json point;
    for (const char* key : {"positions", "velocities", "accelerations", "effort"}) {
      point[key] = cdr.numbers();
    }
    point["time_ns"] = cdr.time_ns();
    return point;
  });
  return line;
}

Json transforms(Cdr& cdr) {
  return {{"transforms", cdr.list([&] {
             Json one = header_of(cdr);
             one["child"] = cdr.text();
             for (const char* axis : {"x", "y", "z"}) one["at"][axis] = cdr.number<double>();
             for (const char* axis : {"x", "y", "z", "w"}) one["turn"][axis] = cdr.number<double>();
             return one;
           })}};
}

Json decode(const std::string& type, const Bytes& bytes) {
  Cdr cdr(bytes);
  Json line = type == "JointState"        ? joint_state(cdr)
              : type == "JointTrajectory" ? trajectory(cdr)
                                          : transforms(cdr);
  if (cdr.left() > 3) throw std::runtime_error("too long");  // padding has up to three bytes
  return line;
}

// Any type, as its bytes.
class RawType : public fast::TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1 << 16;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* /*data*/, rtps::SerializedPayload_t* /*payload*/) override { return false; }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* /*data*/) override {
    return [] { return 1U << 16; };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*key*/, bool /*md5*/) override {
    return false;
  }
};

struct Printer : fast::DataReaderListener {
  explicit Printer(std::string name) : type(std::move(name)) {}
  void on_data_available(fast::DataReader* reader) override {
    fast::SampleInfo info;
    while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) print(decode(type, bytes));
    }
  }
  void on_subscription_matched(fast::DataReader* /*reader*/,
                               const fast::SubscriptionMatchedStatus& status) override {
    print({{"writers", status.current_count}});
  }
  std::string type;
  Bytes bytes;
};

// What a node sees of the writers.
struct Discovered : fast::DomainParticipantListener {
  explicit Discovered(std::string name) : topic(std::move(name)) {}
  void on_publisher_discovery(fast::DomainParticipant* /*participant*/,
                              rtps::WriterDiscoveryInfo&& info) override {
    if (info.info.topicName() != topic.c_str()) return;
    const auto& user = info.info.m_qos.m_userData.getValue();
    print({{"user_data", std::string(user.begin(), user.end())},
           {"reliable", info.info.m_qos.m_reliability.kind == fast::RELIABLE_RELIABILITY_QOS},
           {"volatile", info.info.m_qos.m_durability.kind == fast::VOLATILE_DURABILITY_QOS},
           {"lifespan_ns", info.info.m_qos.m_lifespan.duration.to_ns()}});
  }
  std::string topic;
};

// On loopback only, without multicast.
fast::DomainParticipantQos local_qos() {
  fast::DomainParticipantQos qos;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports = {udp};
  rtps::Locator_t peer;
  rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
  qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  return qos;
}

const char* package_of(const std::string& type) {
  return type == "JointState"        ? "sensor_msgs"
         : type == "JointTrajectory" ? "trajectory_msgs"
                                     : "tf2_msgs";
}

}  // namespace

int main(int count, char** arguments) {
  const std::vector<std::string> words(arguments, arguments + count);
  if (count < 4) return 2;
  const std::string topic = "rt/" + words[2], type = words[3];
  Discovered discovered(topic);
  auto* participant = fast::DomainParticipantFactory::get_instance()->create_participant(
      std::stoi(words[1]), local_qos(), &discovered, fast::StatusMask::none());
  if (participant == nullptr) return 1;
  const fast::TypeSupport support(
      new RawType(std::string(package_of(type)) + "::msg::dds_::" + type + "_"));
  support.register_type(participant);
  auto* there = participant->create_topic(topic, support.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.history().depth = 10;
  if (count > 4)
    qos.lifespan().duration = eprosima::fastrtps::Duration_t(std::stod(words[4]) / 1000.0L);
  Printer printer(type);
  subscriber->create_datareader(there, qos, &printer);
  while (true) pause();  // whoever started it ends it
}
