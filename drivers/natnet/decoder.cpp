#include "drivers/natnet/decoder.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "drivers/byte_reader.hpp"
#include "drivers/glove/device_info.hpp"
#include "drivers/natnet/axes.hpp"
#include "drivers/natnet/protocol.hpp"
#include "drivers/pose_values.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::natnet {
namespace {

constexpr std::array<std::string_view, 2> kUps{"y", "z"};
constexpr std::array<std::string_view, 3> kCoordinates{"auto", "local", "global"};
constexpr std::array<std::string_view, 2> kCasts{"multi", "uni"};
constexpr std::string_view kAnyVersion = "auto";

Eigen::Vector3d vector_of(const Vec3f& v) noexcept {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

}  // namespace

std::string settings_text(const Settings& settings) {
  const auto word = [](const auto& words, auto index) {
    return std::string(words[static_cast<std::size_t>(index)]);
  };
  const Version version = settings.version;
  return "natnet version=" +
         (version.known() ? std::to_string(version.major) + '.' + std::to_string(version.minor)
                          : std::string(kAnyVersion)) +
         " up=" + word(kUps, settings.z_up) +
         " coordinates=" + word(kCoordinates, settings.coordinates) +
         " cast=" + word(kCasts, settings.unicast) + " rate=" + std::to_string(settings.rate_hz);
}

Result<Settings> parse_settings(const std::string& text, const std::string& identity) {
  glove::DeviceInfoReader reader(text, "natnet", identity);
  Settings settings;
  const std::string version = reader.word("version");
  settings.z_up = reader.choice("up", kUps) == 1;
  settings.coordinates = static_cast<Coordinates>(reader.choice("coordinates", kCoordinates));
  settings.unicast = reader.choice("cast", kCasts) == 1;
  settings.rate_hz = reader.whole("rate", 1, 2000);
  TRY(reader.finish());
  if (version == kAnyVersion) return settings;
  const auto parsed = parse_version(version);
  if (!parsed) return fail(parsed.error().message, identity);
  settings.version = *parsed;
  return settings;
}

Result<bool> parse_up(const std::string& word) {
  if (word == "y" || word == "z") return word == "z";
  return misuse("up should be \"y\" or \"z\", as Motive's up axis is set");
}

Result<Coordinates> parse_coordinates(const std::string& word) {
  const auto at = std::ranges::find(kCoordinates, word);
  if (at != kCoordinates.end()) return static_cast<Coordinates>(at - kCoordinates.begin());
  return misuse(
      "coordinates should be \"auto\", \"local\" or \"global\", as Motive's skeleton coordinates "
      "are set");
}

Requests::Requests(bool unicast)
    : connect_{.datagram = encode_connect()},
      rate_{.datagram = encode_text(MessageId::kRequest, "FrameRate")},
      bodies_{.datagram = encode_message(MessageId::kRequestModelDef, {})},
      alive_{.datagram = encode_message(MessageId::kKeepAlive, {}), .wanted = unicast} {}

// A server that says who it is may have restarted, with other bodies.
RT_SAFE void Requests::accept_server_info(const ServerInfo& info) noexcept {
  if (info.data_port != 0 && !info.multicast) alive_.wanted = true;
  connect_.wanted = false;
  rate_.wanted = true;
  bodies_.wanted = true;
}

RT_SAFE void Requests::does_not_fit() noexcept {
  if (connect_.wanted) return;
  connect_.wanted = true;
  connect_.pause_ns = std::min(2 * connect_.pause_ns, kMaxPause_ns);
}

RT_SAFE bool Requests::is_due(Question& question, std::int64_t now_ns) noexcept {
  if (!question.wanted || now_ns < question.next_ns) return false;
  question.next_ns = now_ns + question.pause_ns;
  return true;
}

// The rate before the bodies, whose description carries it.
RT_SAFE std::span<const std::byte> Requests::next(std::int64_t now_ns) noexcept {
  if (received_ns_ != kNoTime_ns && now_ns - received_ns_ > kSilence_ns) {
    connect_.wanted = true;
    connect_.pause_ns = kAgain_ns;
    connect_.next_ns = std::min(connect_.next_ns, now_ns + kAgain_ns);
  }
  if (is_due(connect_, now_ns)) return connect_.datagram;
  if (connect_.wanted) return {};
  if (is_due(rate_, now_ns)) return rate_.datagram;
  if (is_due(bodies_, now_ns)) return bodies_.datagram;
  if (is_due(alive_, now_ns)) return alive_.datagram;
  return {};
}

namespace {

constexpr float kMinServerRate_hz = 1.0F;
constexpr float kMaxServerRate_hz = 10'000.0F;

bool is_from_server(MessageId id) noexcept {
  switch (id) {
    case MessageId::kServerInfo:
    case MessageId::kResponse:
    case MessageId::kModelDef:
    case MessageId::kFrame:
    case MessageId::kMessageText:
    case MessageId::kEchoResponse:
    case MessageId::kUnrecognized:
      return true;
    default:
      return false;
  }
}

Outcome worse(Outcome a, Outcome b) noexcept { return b == Outcome::kOk ? a : b; }

}  // namespace

NatNetDecoder::NatNetDecoder(const Settings& settings)
    : settings_(settings), version_(settings.version), requests_(settings.unicast) {}

RT_SAFE void NatNetDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                                 Sink& sink) noexcept {
  Message message;
  Outcome outcome = decode_message(bytes, message);
  if (outcome == Outcome::kOk) {
    if (is_from_server(message.id)) requests_.received(arrival_ns);
    outcome = accept(message, sink);
  }
  sink.outcome(outcome);
}

RT_SAFE Outcome NatNetDecoder::accept(const Message& message, Sink& sink) noexcept {
  switch (message.id) {
    case MessageId::kServerInfo:
      return accept_server_info(message.payload);
    case MessageId::kResponse:
      return accept_response(message.payload);
    case MessageId::kModelDef:
      return accept_model_def(message.payload, sink);
    case MessageId::kFrame:
      return accept_frame(message.payload, sink);
    default:  // of no use here, or of another client
      return is_from_server(message.id) ? Outcome::kOk : Outcome::kForeign;
  }
}

// The version of the options counts more: somebody has set it.
RT_SAFE Outcome NatNetDecoder::accept_server_info(std::span<const std::byte> payload) noexcept {
  ServerInfo info;
  if (!decode_server_info(payload, info)) return Outcome::kShort;
  const Version said = settings_.version.known() ? settings_.version : info.version;
  const bool fits = misfits_ < kMaxMisfits;
  misfits_ = 0;
  if (!fits && said == version_) {
    requests_.has_not_changed();
    return Outcome::kDuplicate;
  }
  if (said != version_) has_reading_ = false;
  version_ = said;
  clock_hz_ = info.clock_hz;
  requests_.accept_server_info(info);
  return Outcome::kOk;
}

// The only request is that for the rate.
RT_SAFE Outcome NatNetDecoder::accept_response(std::span<const std::byte> payload) noexcept {
  const float rate_hz = ByteReader(payload).f32();
  if (!(rate_hz >= kMinServerRate_hz && rate_hz <= kMaxServerRate_hz)) return Outcome::kOutOfRange;
  rate_hz_ = rate_hz;
  requests_.accept_rate();
  return Outcome::kOk;
}

RT_SAFE Outcome NatNetDecoder::accept_model_def(std::span<const std::byte> payload,
                                                Sink& sink) noexcept {
  const DescriptionHead head{.version = version_, .z_up = settings_.z_up, .rate_hz = rate_hz_};
  write_description_head(head, std::span(description_).first<kDescriptionHeadBytes>());
  const std::size_t size = std::min(payload.size(), description_.size() - kDescriptionHeadBytes);
  std::ranges::copy(payload.first(size), description_.begin() + kDescriptionHeadBytes);
  sink.description(std::span(description_).first(kDescriptionHeadBytes + size));
  requests_.accept_bodies();
  return Outcome::kOk;
}

RT_SAFE bool NatNetDecoder::read(std::span<const std::byte> payload, FrameView& view) noexcept {
  if (has_reading_ && read_frame(payload, reading_, view)) {
    misfits_ = 0;
    requests_.fits();
    return true;
  }
  if (misfits_ < kMaxMisfits) ++misfits_;
  const bool damaged = misfits_ < kMaxMisfits;  // the packet, not the reading
  if (has_reading_ && damaged) return false;
  for (const Reading& reading : Readings(version_)) {
    if (!read_frame(payload, reading, view)) continue;
    reading_ = reading;
    has_reading_ = true;
    misfits_ = 0;
    requests_.fits();
    return true;
  }
  if (!damaged) requests_.does_not_fit();
  return false;
}

RT_SAFE Outcome NatNetDecoder::accept_frame(std::span<const std::byte> payload,
                                            Sink& sink) noexcept {
  FrameView view;
  if (!read(payload, view)) return Outcome::kOutOfRange;
  if (view.bodies_changed) requests_.bodies_changed();
  if (layout_ == nullptr) return Outcome::kForeign;
  if (const Outcome order = order_.accept(view.number); order != Outcome::kOk) return order;
  device_ns_ = time_.of(view, clock_hz_);
  timecode_ = to_timecode(view.timecode);
  emitted_.reset();
  const Outcome bodies = accept_bodies(view, sink);
  return worse(bodies, accept_markers(view, sink));
}

RT_SAFE Outcome NatNetDecoder::accept_bodies(const FrameView& view, Sink& sink) noexcept {
  Outcome worst = Outcome::kOk;
  ByteReader rigid_bodies(view.rigid_bodies.bytes);
  for (std::size_t i = 0; i < view.rigid_bodies.count; ++i) {
    worst = worse(worst, accept_rigid_body(rigid_bodies, sink));
  }
  ByteReader skeletons(view.skeletons.bytes);
  for (std::size_t i = 0; i < view.skeletons.count; ++i) {
    worst = worse(worst, accept_skeleton(skeletons, sink));
  }
  return worst;
}

RT_SAFE Outcome NatNetDecoder::emit(std::size_t body, Frame& frame, Sink& sink) noexcept {
  if (emitted_[body]) return Outcome::kOutOfRange;
  emitted_.set(body);
  frame.header.device_ns = device_ns_;
  frame.timecode = timecode_;
  frame.skeleton = layout_->bodies[body].skeleton->id;
  sink.frame(body, frame);
  return Outcome::kOk;
}

// A body that the description does not have came after it.
RT_SAFE Outcome NatNetDecoder::accept_rigid_body(ByteReader& reader, Sink& sink) noexcept {
  RigidBody rigid;
  if (!read_rigid_body(reader, reading_, false, rigid)) return Outcome::kShort;
  const std::size_t body = layout_->body_of(false, rigid.id);
  if (body == layout_->bodies.size()) {
    requests_.bodies_changed();
    return Outcome::kOutOfRange;
  }
  Frame frame;
  bool has_rotation = false;
  frame.joint_count = 1;
  frame.root_position_m = from_motive(rigid.position_m, settings_.z_up);
  frame.rotation_xyzw[0] = from_motive(rigid.rotation_xyzw, settings_.z_up);
  const bool valid =
      is_plausible(frame.root_position_m) && accept_rotation(frame.rotation_xyzw[0], has_rotation);
  if (!valid) return Outcome::kOutOfRange;
  frame.valid[0] = rigid.tracked && has_rotation;
  if (!frame.valid[0]) {
    frame.rotation_xyzw[0] = kIdentity;
    frame.quality = Quality::kHeld;
  }
  return emit(body, frame, sink);
}

RT_SAFE Outcome NatNetDecoder::accept_skeleton(ByteReader& reader, Sink& sink) noexcept {
  const std::int32_t id = reader.i32();
  const std::size_t bones = reader.i32();  // checked by read_frame
  const std::size_t body = layout_->body_of(true, id);
  const bool known = body < layout_->bodies.size();
  SkeletonPose pose(known ? layout_->tables[body] : nobody_);
  bool valid = known;
  for (std::size_t i = 0; i < bones; ++i) {
    RigidBody bone;
    if (!read_rigid_body(reader, reading_, true, bone)) return Outcome::kShort;
    bone.position_m = from_motive(bone.position_m, settings_.z_up);
    bone.rotation_xyzw = from_motive(bone.rotation_xyzw, settings_.z_up);
    valid = valid && pose.add(bone);
  }
  if (!known || !pose.is_described(bones)) requests_.bodies_changed();
  Frame frame;
  if (!valid || !pose.fill(settings_.coordinates, frame)) return Outcome::kOutOfRange;
  return emit(body, frame, sink);
}

RT_SAFE Outcome NatNetDecoder::accept_markers(const FrameView& view, Sink& sink) noexcept {
  Outcome worst = Outcome::kOk;
  for (std::size_t body = 0; body < layout_->tables.size(); ++body) {
    if (layout_->tables[body].markers == 0) continue;
    worst = worse(worst, accept_markers_of(body, view.labelled, sink));
  }
  return worst;
}

// A marker that the cameras do not see is filled in by Motive: it is not valid.
RT_SAFE Outcome NatNetDecoder::accept_markers_of(std::size_t body, const Entries& labelled,
                                                 Sink& sink) noexcept {
  const BodyTable& table = layout_->tables[body];
  Sample sample;
  bool any = false;
  Outcome worst = Outcome::kOk;
  ByteReader reader(labelled.bytes);
  for (std::size_t i = 0; i < labelled.count; ++i) {
    LabelledMarker marker;
    if (!read_labelled(reader, reading_, marker)) return Outcome::kShort;
    const bool ours = marker.model != 0 && std::int32_t{marker.model} == table.id;
    if (!ours || marker.number == 0 || marker.number > table.markers) continue;
    const Vec3f position_m = from_motive(marker.position_m, settings_.z_up);
    if (!is_plausible(position_m)) {
      worst = Outcome::kOutOfRange;
      continue;
    }
    any = true;
    for (std::size_t axis = 0; axis < position_m.size(); ++axis) {
      const std::size_t value = 3 * (marker.number - std::size_t{1}) + axis;
      sample.value[value] = position_m[axis];
      sample.valid[value] = !marker.occluded;
    }
  }
  if (!any) return worst;
  sample.header.device_ns = device_ns_;
  sample.value_count = static_cast<std::uint16_t>(3 * table.markers);
  sink.sample(body, sample);
  return worst;
}

bool SkeletonPose::add(const RigidBody& bone) noexcept {
  // The low word of an id is the bone, the high word the skeleton.
  const auto id = static_cast<std::uint16_t>(static_cast<std::uint32_t>(bone.id) & 0xffff);
  const std::size_t joint = table_.joint_of(id, next_);
  next_ = joint + 1;
  undescribed_ = undescribed_ || joint >= table_.bone_ids.size();
  if (joint >= table_.bone_ids.size() || seen_[joint] || !is_plausible(bone.position_m)) {
    return false;
  }
  bool has_rotation = false;
  Quatf rotation = bone.rotation_xyzw;
  if (!accept_rotation(rotation, has_rotation)) return false;
  seen_.set(joint);
  tracked_[joint] = bone.tracked && has_rotation;
  position_m_[joint] = bone.position_m;
  rotation_xyzw_[joint] = rotation;
  return true;
}

bool SkeletonPose::looks_local() const noexcept {
  double local_m = 0.0;  // misfit of each reading
  double global_m = 0.0;
  for (std::size_t j = 1; j < table_.parents.size(); ++j) {
    const std::size_t parent = table_.parents[j];
    const Eigen::Vector3d offset_m = vector_of(table_.offsets_m[j]);
    const Eigen::Vector3d here_m = vector_of(position_m_[j]);
    const Eigen::Vector3d from_parent_m = here_m - vector_of(position_m_[parent]);
    local_m += (here_m - offset_m).norm();
    global_m += (from_parent_m - to_eigen_double(rotation_xyzw_[parent]) * offset_m).norm();
  }
  return local_m < global_m;
}

bool SkeletonPose::fill(Coordinates coordinates, Frame& frame) const noexcept {
  const std::size_t joints = table_.bone_ids.size();
  if (seen_.count() != joints) return false;
  const bool local =
      coordinates == Coordinates::kAuto ? looks_local() : coordinates == Coordinates::kLocal;
  frame.joint_count = static_cast<std::uint16_t>(joints);
  frame.root_position_m = position_m_[0];
  frame.valid = tracked_;
  frame.quality = tracked_.any() ? Quality::kMeasured : Quality::kHeld;
  // In the room. A bone that is not tracked turns with its parent, and its children are relative to
  // that.
  std::array<Eigen::Quaterniond, kMaxJoints> turned;
  for (std::size_t j = 0; j < joints; ++j) {
    const Eigen::Quaterniond above =
        j == 0 ? Eigen::Quaterniond::Identity() : turned[table_.parents[j]];
    if (!tracked_[j]) {
      frame.rotation_xyzw[j] = kIdentity;
      turned[j] = above;
    } else if (local || j == 0) {
      frame.rotation_xyzw[j] = rotation_xyzw_[j];
      turned[j] = above * to_eigen_double(rotation_xyzw_[j]);
    } else {
      turned[j] = to_eigen_double(rotation_xyzw_[j]);
      frame.rotation_xyzw[j] = from_eigen(above.conjugate() * turned[j]);
    }
  }
  return true;
}

}  // namespace posed::drivers::natnet
