#include "daemon/output/ros2/dds.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <expected>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>

#include <ifaddrs.h>
#include <linux/filter.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <spdlog/spdlog.h>

#include "drivers/transport/address.hpp"
#include "posed/ros2/messages.h"
#include "proto/text/clean.hpp"

namespace posed::output {

// By tests/ros2/type_hashes.py from messages.idl.
const Ros2Type kJointState{
    &sensor_msgs_msg_dds__JointState__desc,
    "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"};
const Ros2Type kJointTrajectory{
    &trajectory_msgs_msg_dds__JointTrajectory__desc,
    "RIHS01_179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e"};
const Ros2Type kTfMessage{
    &tf2_msgs_msg_dds__TFMessage__desc,
    "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"};

namespace {

// DDS's rule for ports.
constexpr int kFirstPort = 7400, kPortsOfDomain = 250;
constexpr int kSockets = 2;         // on which a domain listens
constexpr int kMaxNeighbours = 32;  // programs in the domain on one computer that are looked for

std::unexpected<Error> dds_error(const std::string& what, dds_return_t code) {
  return fail(what + " (DDS says: " + dds_strretcode(-code) + ")");
}

// What is said of a message that makes no sense ends in its parts and bytes, of which no two are
// alike, so that the log would not count such lines together.
std::string_view without_bytes(std::string_view text) {
  for (const std::string_view kind : {"malformed ", "invalid ", "Invalid "}) {
    if (!text.starts_with(kind)) continue;
    return text.substr(0, std::min(text.find(" state "), text.find_first_of("(<")));
  }
  return text;
}

void log_dds(void* /*unused*/, const dds_log_data_t* data) {
  spdlog::warn("DDS: {}", clean(without_bytes({data->message, data->size})));
}

// The IPv4 address of an interface, in the order of the network's bytes.
std::optional<std::uint32_t> address_of(const std::string& interface) {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return std::nullopt;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(all, &::freeifaddrs);
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    if (interface != one->ifa_name) continue;
    sockaddr_in address{};
    std::memcpy(&address, one->ifa_addr, sizeof address);
    return address.sin_addr.s_addr;
  }
  return std::nullopt;
}

// Cyclone listens on 0.0.0.0 whatever the interface. The kernel passes these sockets only datagrams
// from this computer (it drops those that come from outside under such an address) and the peers.
Result<> fence(int socket, const std::vector<std::uint32_t>& allowed) {
  constexpr std::uint32_t kSource = static_cast<std::uint32_t>(SKF_NET_OFF) + 12;
  std::vector<sock_filter> code;
  const auto count = static_cast<std::uint8_t>(allowed.size());
  code.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kSource));
  for (std::uint8_t i = 0; i < count; ++i) {
    const auto to_end = static_cast<std::uint8_t>(count - i + 2);
    code.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(allowed[i]), to_end, 0));
  }
  code.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, 0xFF000000U));
  code.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0x7F000000U, 1, 0));
  code.push_back(BPF_STMT(BPF_RET | BPF_K, 0));
  code.push_back(BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFFU));
  const sock_fprog program{.len = static_cast<unsigned short>(code.size()), .filter = code.data()};
  if (::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0) return {};
  return fail("the kernel does not filter what DDS receives (" + errno_text() + ")");
}

// What is open: the descriptors by the names that are never used again, like socket:[1234].
std::map<std::string, int> open_files() {
  std::map<std::string, int> files;
  std::error_code none;
  for (std::filesystem::directory_iterator file("/proc/self/fd", none), end; !none && file != end;
       file.increment(none)) {
    std::error_code gone;  // closed meanwhile
    const auto name = std::filesystem::read_symlink(file->path(), gone);
    if (!gone) files.emplace(name, std::atoi(file->path().filename().c_str()));
  }
  return files;
}

bool listens_for(int file, int domain) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (::getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0) return false;
  const int first = kFirstPort + kPortsOfDomain * domain;
  const int port = ntohs(address.sin_port);
  return address.sin_family == AF_INET && port >= first && port < first + kPortsOfDomain;
}

// The sockets that a new domain has opened; `before` were open already.
Result<> fence_all(const DdsPlace& place, std::uint32_t own,
                   const std::map<std::string, int>& before) {
  std::vector<std::uint32_t> allowed{own};
  for (const std::string& peer : place.peers) {
    const auto host = TRY(drivers::parse_host(peer));
    sockaddr_in address{};
    std::memcpy(&address, host.get(), sizeof address);
    allowed.push_back(address.sin_addr.s_addr);
  }
  int fenced = 0;
  for (const auto& [name, file] : open_files()) {
    if (before.contains(name) || !listens_for(file, place.domain)) continue;
    TRY(fence(file, allowed));
    ++fenced;
  }
  if (fenced < kSockets) return fail("the sockets of DDS were not found");
  return {};
}

std::string settings_of(const DdsPlace& place, const std::string& own) {
  std::string peers;
  for (const std::string& peer : place.peers) {
    const auto host = drivers::parse_host(peer);  // in numbers, so that names mean one computer
    if (host) peers += "<Peer address=\"" + drivers::host_text(*host) + "\"/>";
  }
  return "<CycloneDDS><Domain Id=\"any\"><General><Interfaces><NetworkInterface name=\"" +
         place.interface +
         "\" multicast=\"false\"/></Interfaces><AllowMulticast>false</AllowMulticast></General>"
         "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>" +
         std::to_string(kMaxNeighbours) + "</MaxAutoParticipantIndex><Peers><Peer address=\"" +
         own + "\"/>" + peers + "</Peers></Discovery></Domain></CycloneDDS>";
}

// The domains of this program by their numbers.
struct Joined {
  std::mutex mutex;
  std::map<int, std::weak_ptr<DdsDomain>> domains;
};
Joined& joined() {
  static Joined all;
  return all;
}

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

Qos quality_of(const Ros2Type& type) {
  Qos qos(dds_create_qos(), &dds_delete_qos);
  // A writer that may not wait says at once that a reader is slow.
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, 0);
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_lifespan(qos.get(), DdsWriter::kLifespan_ns);
  // All implementations read it.
  const dds_data_representation_id_t encoding = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos.get(), 1, &encoding);
  const std::string hash = std::string("typehash=") + type.hash + ";";
  dds_qset_userdata(qos.get(), hash.data(), hash.size());
  return qos;
}

}  // namespace

Result<std::shared_ptr<DdsDomain>> DdsDomain::join(const DdsPlace& place) {
  const std::scoped_lock lock(joined().mutex);
  std::weak_ptr<DdsDomain>& known = joined().domains[place.domain];
  if (auto there = known.lock()) {
    if (there->place_ == place) return there;
    return fail("another output has DDS domain " + std::to_string(place.domain) +
                " on another interface or with other peers; write the same in both");
  }
  const auto own = address_of(place.interface);
  if (!own) {
    return fail("there is no network interface " + in_quotes(place.interface) +
                " with an IPv4 address; `ip -4 address` lists them");
  }
  ::dds_set_log_sink(&log_dds, nullptr);
  const auto before = open_files();
  const std::string text = drivers::host_text(drivers::ipv4_address(ntohl(*own)));
  const auto id = static_cast<dds_domainid_t>(place.domain);
  const dds_entity_t domain = ::dds_create_domain(id, settings_of(place, text).c_str());
  if (domain < 0)
    return dds_error("cannot join DDS domain " + std::to_string(place.domain), domain);
  std::shared_ptr<DdsDomain> made(new DdsDomain(place, domain));
  TRY(fence_all(place, *own, before));
  made->participant_ = ::dds_create_participant(id, nullptr, nullptr);
  if (made->participant_ < 0) return dds_error("cannot take part in DDS", made->participant_);
  known = made;
  return made;
}

DdsDomain::~DdsDomain() { ::dds_delete(domain_); }

Result<DdsWriter> DdsWriter::open(std::shared_ptr<DdsDomain> domain, const Ros2Type& type,
                                  const std::string& topic) {
  const Qos qos = quality_of(type);
  const std::string name = "rt/" + topic;  // ROS 2's prefix of topics
  const dds_entity_t made =
      ::dds_create_topic(domain->participant(), type.descriptor, name.c_str(), nullptr, nullptr);
  if (made < 0) return dds_error("cannot be sent as topic " + topic, made);
  const dds_entity_t writer = ::dds_create_writer(domain->participant(), made, qos.get(), nullptr);
  if (writer >= 0) return DdsWriter(std::move(domain), made, writer);
  ::dds_delete(made);
  return dds_error("cannot be sent as topic " + topic, writer);
}

DdsWriter::DdsWriter(DdsWriter&& other) noexcept
    : domain_(std::move(other.domain_)), topic_(other.topic_), writer_(other.writer_) {}

DdsWriter::~DdsWriter() {
  if (domain_ == nullptr) return;  // moved from
  ::dds_delete(writer_);
  ::dds_delete(topic_);
}

std::size_t DdsWriter::readers() const noexcept {
  dds_publication_matched_status_t status{};
  if (::dds_get_publication_matched_status(writer_, &status) != DDS_RETCODE_OK) return 0;
  return status.current_count;
}

SendOutcome DdsWriter::write(const void* sample) noexcept {
  const std::size_t count = readers();
  if (count == 0) return {};
  const dds_return_t wrote = ::dds_write(writer_, sample);
  if (wrote == DDS_RETCODE_OK) return {.sent = count};
  if (wrote == DDS_RETCODE_TIMEOUT) return {.dropped = count};
  return {.failed = count};
}

}  // namespace posed::output
