#include "daemon/output/natnet_output.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <set>
#include <utility>
#include <vector>

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "daemon/output/datagram_encoder.hpp"
#include "drivers/byte_reader.hpp"
#include "drivers/byte_writer.hpp"
#include "drivers/natnet/figure.hpp"
#include "drivers/transport/socket.hpp"

namespace posed::output {
namespace {

namespace natnet = drivers::natnet;

// Whether it is one of Motive's: with its own names, or with those that it gives for FBX and BVH.
// Files of such names have channels.
bool is_of_motive(const Skeleton& skeleton) {
  const auto is_named = [&](Bone bone, std::string_view name) {
    const int joint = skeleton.joint_of(bone);
    return joint >= 0 && skeleton.joints[joint].name == name;
  };
  const bool named =
      is_named(Bone::kHips, "Hip") ||
      (is_named(Bone::kHips, "Hips") &&
       (is_named(Bone::kLeftUpperArm, "LeftArm") || is_named(Bone::kLeftUpperArm, "LeftShoulder")));
  return named && skeleton.channels.empty() && skeleton.joints[0].bone == Bone::kHips &&
         rests_unturned(skeleton);
}

natnet::BodyDef describe_body(const Skeleton& skeleton, const std::string& name, bool prop) {
  natnet::BodyDef body{.name = name, .is_skeleton = !prop, .bones = {}};
  for (const Joint& joint : skeleton.joints) {
    const Eigen::Vector3f offset_m = joint.offset_m.cast<float>();
    body.bones.push_back({.name = name + "_" + joint.name,
                          .id = static_cast<std::int32_t>(body.bones.size()) + 1,
                          .parent = joint.parent + 1,  // 0: none
                          .offset_m = {offset_m.x(), offset_m.y(), offset_m.z()}});
  }
  if (prop) body.bones[0] = {.name = name, .parent = -1};
  return body;
}

std::uint32_t packed(const Timecode& timecode) {
  std::uint32_t fields = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const int tens = timecode[3 * i] - '0', ones = timecode[3 * i + 1] - '0';
    if (tens < 0 || tens > 9 || ones < 0 || ones > 9) return 0;
    fields = fields << 8 | static_cast<std::uint32_t>(10 * tens + ones);
  }
  // Thousandths of a second are no frames.
  return timecode[8] == ':' ? fields : 0;
}

constexpr int kMaxRequests = 16;           // that are answered in one turn
constexpr std::size_t kMaxRequest = 1024;  // bytes; Connect, the longest, has less than 300
constexpr natnet::Version kNewest{4, 1};
constexpr std::int32_t kMaxId = 32'767;  // a bone's number has its skeleton's in the upper 16 bits
constexpr double kUsualRate_hz = 120.0;  // where the stream does not know its own

// Frames for a group leave by the interface that the server has.
void choose_interface(int fd, const drivers::Address& listen) noexcept {
  if (listen.storage.ss_family != AF_INET) return;
  sockaddr_in address{};
  std::memcpy(&address, listen.get(), sizeof address);
  if (address.sin_addr.s_addr == htonl(INADDR_ANY)) return;
  ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &address.sin_addr, sizeof address.sin_addr);
}

std::vector<std::byte> number_response(float value) {
  drivers::ByteWriter writer;
  writer.f32(value);
  return natnet::encode_message(natnet::MessageId::kResponse, writer.written());
}

}  // namespace

std::uint64_t NatNetScene::ticks_at(std::int64_t time_ns) noexcept {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(time_ns, 0)) /
         (kNanosPerSecond / kClock_hz);
}

Result<> NatNetScene::set_stream(std::size_t place, const LiveStream* stream) {
  auto& body = bodies_[place];
  const bool was = body.has_value();
  body.reset();
  names_[place].clear();
  if (was) describe();
  if (stream == nullptr) return {};
  const auto& skeleton = stream->skeleton;
  const bool prop = skeleton != nullptr && is_prop(*skeleton);
  const bool own = skeleton != nullptr && (prop || is_of_motive(*skeleton));
  const std::string name =
      distinct_name(own ? skeleton->name : stream->name, stream->name, place, names_);
  auto fit = TRY(Fit::make(skeleton, own, [&](double scale) {
    return natnet::skeleton_of(
        natnet::average_person(name, /*id=*/1, static_cast<float>(scale), has_fingers(*skeleton)));
  }));
  Body& made = body.emplace(std::move(fit), own);
  made.rate_hz = stream->rate_hz;
  made.described = describe_body(made.fit.skeleton(), name, prop);
  made.number = stream->number;
  for (const natnet::BoneDef& bone : made.described.bones) {
    made.packet.bones.push_back({.position_m = bone.offset_m, .rotation_xyzw = kIdentity});
  }
  describe();
  return {};
}

// Programs ask for props by number, so the source's own is kept where it has no namesake.
void NatNetScene::number_bodies() {
  std::array<std::set<std::int32_t>, 2> taken;  // of props, of people
  const auto number = [&](Body& body, std::int32_t id) {
    const bool prop = !body.described.is_skeleton;
    if (id <= 0 || id > kMaxId || !taken[prop ? 0 : 1].insert(id).second) return false;
    body.described.id = body.packet.id = id;
    if (prop) body.described.bones[0].id = id;
    for (std::size_t i = 0; i < body.packet.bones.size(); ++i) {
      body.packet.bones[i].id = prop ? id : id << 16 | body.described.bones[i].id;
    }
    return true;
  };
  std::vector<std::size_t> left;
  for (std::size_t place = 0; place < bodies_.size(); ++place) {
    if (bodies_[place] && !number(*bodies_[place], bodies_[place]->number)) left.push_back(place);
  }
  for (const std::size_t place : left) {
    auto id = static_cast<std::int32_t>(place + 1);
    while (!number(*bodies_[place], id)) ++id;
  }
}

void NatNetScene::describe() {
  number_bodies();
  model_ = {};
  rate_hz_ = 0.0;
  for (const auto& body : bodies_) {
    if (!body) continue;
    model_.bodies.push_back(body->described);
    rate_hz_ = std::max(rate_hz_, body->rate_hz);
  }
  changed_ = true;
}

bool NatNetScene::take(std::size_t place, const Frame& frame) {
  auto& body = bodies_[place];
  if (!body) return false;
  const Frame& pose = body->fit.apply(frame);
  auto& bones = body->packet.bones;
  for (std::size_t j = 0; j < bones.size(); ++j) {
    bones[j].rotation_xyzw = pose.rotation_xyzw[j];
    bones[j].tracked = frame.quality != Quality::kStale && (!body->own || frame.valid[j]);
  }
  bones[0].position_m = pose.root_position_m;
  body->posed = true;
  advance(time_ns_, frame.header);
  if (begin_ns_ == kNoTime_ns) begin_ns_ = time_ns_;
  timecode_ = frame.timecode;
  return true;
}

const natnet::FramePacket& NatNetScene::next_frame(std::int64_t now_ns) {
  packet_.bodies_changed = std::exchange(changed_, false);
  ++packet_.number;
  packet_.timecode = packed(timecode_);
  packet_.timestamp_s = seconds(time_ns_ - begin_ns_);
  packet_.exposure_ticks = ticks_at(time_ns_);
  packet_.received_ticks = ticks_at(std::max(time_ns_, now_ns));
  packet_.sent_ticks = packet_.received_ticks;
  packet_.rigid_bodies.clear();
  std::size_t people = 0;
  for (const auto& body : bodies_) {
    if (!body || !body->posed) continue;
    if (!body->described.is_skeleton) {
      packet_.rigid_bodies.push_back(body->packet.bones[0]);
      continue;
    }
    // What is there is written over, so that a frame allocates nothing.
    if (people == packet_.skeletons.size()) packet_.skeletons.emplace_back();
    packet_.skeletons[people++] = body->packet;
  }
  packet_.skeletons.resize(people);
  return packet_;
}

Result<std::unique_ptr<Output>> NatNetOutput::open(const config::OutputConfig& config,
                                                   std::unique_ptr<system::EventFd> wake) {
  const auto address = TRY(drivers::listen_address(config.listen, config.peers, "the clients'"));
  std::optional<drivers::Address> group;
  if (!config.group.empty()) {
    group = TRY(drivers::parse_endpoint(config.group + ":" + std::to_string(config.data_port)));
  }
  auto peers = TRY(drivers::Peers::parse(config.peers));
  const int fd = drivers::bind_socket(address, SOCK_DGRAM, /*shared=*/false);
  if (fd < 0) {
    return fail("cannot listen on " + config.listen + " (" + errno_text() +
                "); Motive or another program may have the port: end it, or choose another one");
  }
  choose_interface(fd, address);
  return std::make_unique<NatNetOutput>(config, std::move(wake), fd, std::move(peers), group);
}

NatNetOutput::NatNetOutput(const config::OutputConfig& config,
                           std::unique_ptr<system::EventFd> wake, int fd, drivers::Peers peers,
                           std::optional<drivers::Address> group)
    : Output(config, std::move(wake), /*together=*/true),
      fd_(fd),
      peers_(std::move(peers)),
      data_port_(static_cast<std::uint16_t>(config.data_port)),
      limit_hz_(config.rate_hz),
      group_(group),
      usual_(group ? natnet::read_version(config.version).value_or(kNewest) : kNewest),
      scene_(config.people()) {}

NatNetOutput::~NatNetOutput() { ::close(fd_); }

std::string NatNetOutput::endpoint() const {
  return drivers::endpoint_text(drivers::bound_address(fd_));
}

Result<> NatNetOutput::set_stream(std::size_t place, const LiveStream* stream) {
  const auto set = scene_.set_stream(place, stream);
  if (!set) return fail("cannot be sent: " + set.error().message);
  return {};
}

void NatNetOutput::begin_turn(std::int64_t now_ns) {
  std::array<std::byte, kMaxRequest> buffer;
  more_ = true;
  for (int i = 0; i < kMaxRequests; ++i) {
    drivers::Address from;
    const ssize_t size = ::recvfrom(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT | MSG_TRUNC,
                                    from.get(), &from.size);
    if (size < 0) {
      // A refusal belongs to an earlier answer: a client has gone.
      if (errno == EINTR || errno == ECONNREFUSED) continue;
      more_ = false;
      break;
    }
    natnet::Message message;
    const auto bytes = static_cast<std::size_t>(size);
    // Nobody else gets an answer, so that nobody can be flooded with them.
    if (bytes > buffer.size() || !peers_.allow(drivers::host_of(from))) continue;
    const auto request = std::span(buffer).first(bytes);
    if (natnet::decode_request(request, message) != Outcome::kOk) continue;
    answer(from, message, now_ns);
  }
  const auto live = std::ranges::count_if(
      clients_, [&](const Client& client) { return is_live(client, now_ns); });
  live_ = static_cast<std::size_t>(live);
  set_receivers(live_ + (group_ ? 1 : 0));
}

bool NatNetOutput::take(std::size_t place, const Frame& frame, std::int64_t /*now_ns*/) {
  return scene_.take(place, frame);
}

std::int64_t NatNetOutput::end_turn(std::int64_t now_ns) {
  if (more_) return now_ns;
  return live_ > 0 ? now_ns + kSilent_ns : system::kForever_ns;
}

NatNetOutput::Client* NatNetOutput::find(const drivers::Address& address) noexcept {
  const auto at = std::ranges::find_if(clients_, [&](const Client& client) {
    return drivers::host_of(client.address) == drivers::host_of(address) &&
           drivers::port_of(client.address) == drivers::port_of(address);
  });
  return at == clients_.end() ? nullptr : &*at;
}

void NatNetOutput::admit(const drivers::Address& address, Version version, std::int64_t now_ns) {
  if (Client* known = find(address); known != nullptr) {
    known->version = version;
    return;
  }
  if (clients_.size() == kMaxClients) {
    const auto silent = std::ranges::min_element(clients_, {}, &Client::heard_ns);
    if (!is_live(*silent, now_ns)) clients_.erase(silent);
  }
  if (clients_.size() < kMaxClients) {
    clients_.push_back({.address = address, .version = version, .heard_ns = now_ns});
  } else if (refused_ns_ == kNoTime_ns || now_ns >= refused_ns_ + kNanosPerSecond) {
    refused_ns_ = now_ns;
    notify({.text = drivers::host_text(address) + " was refused: there are " +
                    std::to_string(kMaxClients) + " clients, the most there may be"});
  }
}

void NatNetOutput::answer(const drivers::Address& from, const natnet::Message& message,
                          std::int64_t now_ns) {
  Client* client = find(from);
  if (client != nullptr) client->heard_ns = now_ns;
  const Version version = client == nullptr ? usual_ : client->version;
  switch (message.id) {
    case natnet::MessageId::kConnect:
    case natnet::MessageId::kDiscovery: {
      const Version wanted = natnet::version_for(message.payload);
      // With a group a client gets the frames there, unless it says that it is alive here.
      const bool connects = message.id == natnet::MessageId::kConnect;
      if (connects && (!group_ || client != nullptr)) {
        admit(from, group_ ? usual_ : wanted, now_ns);
      }
      natnet::ServerInfo info{.name = "posed",
                              .version = group_ ? usual_ : wanted,
                              .clock_hz = NatNetScene::kClock_hz,
                              .data_port = data_port_,
                              .multicast = group_.has_value()};
      for (std::size_t i = 12; group_ && i < 16; ++i) {
        info.group = info.group << 8 | drivers::host_of(*group_)[i];
      }
      return send_to(from, natnet::encode_server_info(info));
    }
    case natnet::MessageId::kKeepAlive:
      // Without a group a client says first which version it reads.
      if (client == nullptr && group_) admit(from, usual_, now_ns);
      return;
    case natnet::MessageId::kDisconnect:
      if (client != nullptr) clients_.erase(clients_.begin() + (client - clients_.data()));
      return;
    case natnet::MessageId::kRequestModelDef:
      return send_to(from, natnet::encode_model_def(scene_.model(), version));
    case natnet::MessageId::kRequest:
      return send_to(from, answer_request(message.payload, client));
    case natnet::MessageId::kEchoRequest: {
      if (message.payload.size() < sizeof(std::uint64_t)) return;
      drivers::ByteWriter ticks;
      ticks.u64(drivers::ByteReader(message.payload).u64());
      ticks.u64(NatNetScene::ticks_at(now_ns));
      return send_to(from,
                     natnet::encode_message(natnet::MessageId::kEchoResponse, ticks.written()));
    }
    default:
      return send_to(from, natnet::encode_message(natnet::MessageId::kUnrecognized, {}));
  }
}

NatNetOutput::Bytes NatNetOutput::answer_request(std::span<const std::byte> payload,
                                                 Client* client) const {
  constexpr std::string_view kBitstream = "Bitstream";
  std::string_view text(reinterpret_cast<const char*>(payload.data()), payload.size());
  text = text.substr(0, text.find('\0'));
  if (text == "FrameRate") {
    const double streams_hz = scene_.rate_hz() > 0.0 ? scene_.rate_hz() : kUsualRate_hz;
    return number_response(
        static_cast<float>(limit_hz_ > 0.0 ? std::min(limit_hz_, streams_hz) : streams_hz));
  }
  if (text == "UnitsToMillimeters") return number_response(1000.0F);
  if (!text.starts_with(kBitstream)) {
    return natnet::encode_message(natnet::MessageId::kUnrecognized, {});
  }
  text.remove_prefix(kBitstream.size());
  if (text.starts_with(',') && client != nullptr) {
    const auto asked = natnet::read_version(text.substr(1));
    if (asked) client->version = natnet::nearest_version(*asked);
  }
  const Version version = client == nullptr ? usual_ : client->version;
  return natnet::encode_text(natnet::MessageId::kResponse, std::string(kBitstream) + "," +
                                                               std::to_string(version.major) + "." +
                                                               std::to_string(version.minor));
}

void NatNetOutput::send(std::int64_t now_ns) {
  if (live_ == 0 && !group_) return;
  const natnet::FramePacket& frame = scene_.next_frame(now_ns);
  // Clients of one version get the same bytes.
  std::ranges::stable_sort(clients_, {}, &Client::version);
  Version encoded;
  Bytes datagram;
  const auto encode = [&](Version version) {
    if (version != encoded) datagram = natnet::encode_frame(frame, {.version = version});
    encoded = version;
  };
  for (const Client& client : clients_) {
    if (!is_live(client, now_ns)) continue;
    encode(client.version);
    send_to(client.address, datagram);
  }
  if (!group_) return;
  encode(usual_);
  send_to(*group_, datagram);
}

void NatNetOutput::send_to(const drivers::Address& to,
                           std::span<const std::byte> datagram) noexcept {
  const ssize_t sent = ::sendto(fd_, datagram.data(), datagram.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                                to.get(), to.size);
  const bool slow = sent < 0 && (errno == EAGAIN || errno == ENOBUFS);
  count({.sent = sent >= 0 ? 1U : 0U,
         .dropped = slow ? 1U : 0U,
         .failed = sent < 0 && !slow ? 1U : 0U});
}

}  // namespace posed::output
