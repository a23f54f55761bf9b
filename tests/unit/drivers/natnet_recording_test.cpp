// The NatNet decoder on real recordings: a session of Motive 2.1 (NatNet 3.0) with what the
// vendor's own client printed, and packets of Motive 1.5, 1.7 and 1.9 (NatNet 2.5, 2.7 and 2.9).
// Expected values are read at fixed places of the packets, without the decoder's functions.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "drivers/natnet/model_def.hpp"
#include "tests/support/pcapng.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/drivers/natnet_rig.hpp"

namespace posed::drivers {
namespace {

using test::datagrams_of;
using test::file_bytes;
using test::NatNetBytes;
using test::NatNetRig;
using test::value_at;

constexpr const char* kSession = "data/streams/natnet_python_natnet";
constexpr const char* kOldFrames = "data/streams/natnet_motive_frames";
constexpr int kSessionFrames = 518;
constexpr int kPrintedFrames = 251;  // the client printed only part of the session
constexpr std::size_t kSessionFrameBytes = 336;

Vec3f vector_at(std::span<const std::byte> bytes, std::size_t place) {
  return {value_at<float>(bytes, place), value_at<float>(bytes, place + 4),
          value_at<float>(bytes, place + 8)};
}

std::vector<NatNetBytes> with_id(const std::vector<NatNetBytes>& datagrams, std::uint16_t id) {
  std::vector<NatNetBytes> found;
  for (const NatNetBytes& datagram : datagrams) {
    if (value_at<std::uint16_t>(datagram, 0) == id) found.push_back(datagram);
  }
  return found;
}

struct RecordedSession {
  explicit RecordedSession(const std::filesystem::path& folder)
      : all(datagrams_of(file_bytes(folder / "raw/traffic.pcapng"))), frames(with_id(all, 7)) {
    REQUIRE(frames.size() == kSessionFrames);
  }
  std::vector<NatNetBytes> all, frames;
};

// Feeds what the server says about itself and its bodies.
void introduce(NatNetRig& rig, const RecordedSession& session) {
  REQUIRE(rig.feed(with_id(session.all, 1).at(0)) == Outcome::kOk);
  REQUIRE(rig.feed(with_id(session.all, 5).at(0)) == Outcome::kOk);
}

double distance(const Quatf& a, const Quatf& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) sum += std::abs(static_cast<double>(a[i] - b[i]));
  return sum;
}

}  // namespace

TEST_CASE("the bodies of the recorded NatNet session") {
  const auto folder = test::shared(kSession);
  if (!folder) SKIP_WITHOUT_SHARED();
  const RecordedSession session(*folder);
  NatNetRig rig;
  introduce(rig, session);
  REQUIRE(rig.layout().bodies.size() == 1);
  const Body& body = rig.layout().bodies[0];
  CHECK(body.name == "RaceQuad");
  CHECK(body.skeleton->joints.size() == 1);
  CHECK(body.samples.names.size() == 15);
  CHECK(body.samples.names[0] == "marker_1_x");
  CHECK(body.samples.names[14] == "marker_5_z");
  // Two readings of this version agree, and neither leaves a byte over.
  const auto model =
      natnet::parse_model_def(std::span(with_id(session.all, 5)[0]).subspan(4), {3, 0});
  REQUIRE(model);
  CHECK(model->bodies.at(0).id == 2);
  CHECK(model->bodies[0].bones.at(0).markers == 5);
  CHECK(model->markers.at("RaceQuad") == 5);
}

TEST_CASE("every frame of the recorded NatNet session, with the values that stand in its bytes") {
  const auto folder = test::shared(kSession);
  if (!folder) SKIP_WITHOUT_SHARED();
  const RecordedSession session(*folder);
  NatNetRig rig;
  introduce(rig, session);
  for (const NatNetBytes& bytes : session.frames) {
    REQUIRE(bytes.size() == kSessionFrameBytes);
    REQUIRE(rig.feed(bytes) == Outcome::kOk);
    const Frame& frame = rig.sink.frames.back();
    CHECK(frame.root_position_m == vector_at(bytes, 84));
    Quatf rotation{};
    for (std::size_t i = 0; i < 4; ++i) rotation[i] = value_at<float>(bytes, 96 + 4 * i);
    CHECK(distance(frame.rotation_xyzw[0], rotation) < 1e-6);
    CHECK(frame.valid[0] == ((value_at<std::int16_t>(bytes, 116) & 1) != 0));
    const Sample& sample = rig.sink.samples.back();
    for (std::size_t marker = 0; marker < 5; ++marker) {
      const std::size_t entry = 126 + 26 * marker;
      REQUIRE(value_at<std::uint32_t>(bytes, entry) == (2U << 16 | (marker + 1)));
      const Vec3f position_m = vector_at(bytes, entry + 4);
      const bool occluded = (value_at<std::int16_t>(bytes, entry + 20) & 1) != 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        CHECK(sample.value[3 * marker + axis] == position_m[axis]);
        CHECK(sample.valid[3 * marker + axis] != occluded);
      }
    }
  }
  CHECK(rig.sink.frames.size() == kSessionFrames);
  CHECK(rig.sink.samples.size() == kSessionFrames);
  // The server counts 3 312 787 ticks a second; 120 frames a second were asked of the cameras.
  const auto ticks = [&](const NatNetBytes& bytes) { return value_at<std::uint64_t>(bytes, 306); };
  const auto step_ns =
      rig.sink.frames.back().header.device_ns - rig.sink.frames[0].header.device_ns;
  const double expected_s =
      static_cast<double>(ticks(session.frames.back()) - ticks(session.frames[0])) / 3'312'787.0;
  CHECK(seconds(step_ns) == Approx(expected_s).margin(1e-8));
  CHECK((kSessionFrames - 1) / seconds(step_ns) == Approx(120.0).margin(0.01));
}

TEST_CASE("the recorded NatNet session reads the same when nobody has said its version") {
  const auto folder = test::shared(kSession);
  if (!folder) SKIP_WITHOUT_SHARED();
  const RecordedSession session(*folder);
  NatNetRig reported;
  introduce(reported, session);
  NatNetRig alone;
  REQUIRE(alone.feed(with_id(session.all, 5).at(0)) == Outcome::kOk);
  for (const NatNetBytes& bytes : session.frames) {
    REQUIRE(reported.feed(bytes) == Outcome::kOk);
    REQUIRE(alone.feed(bytes) == Outcome::kOk);
    CHECK(test::same_pose(alone.sink.frames.back(), reported.sink.frames.back()));
  }
}

TEST_CASE("all datagrams of the recorded NatNet session in their order") {
  const auto folder = test::shared(kSession);
  if (!folder) SKIP_WITHOUT_SHARED();
  const RecordedSession session(*folder);
  NatNetRig rig;
  for (const NatNetBytes& datagram : session.all) (void)rig.feed(datagram);
  const int before = rig.sink.count(Outcome::kForeign);
  CHECK(rig.sink.frames.size() > 0);
  // What the client sent is foreign, and so are frames before the description.
  CHECK(rig.sink.count(Outcome::kShort) == 0);
  CHECK(static_cast<int>(rig.sink.frames.size()) + before >= kSessionFrames);
}

namespace {

// What the vendor's client printed of one frame, with two decimals.
struct Printed {
  std::array<double, 7> body{};                 // position, rotation
  std::map<int, std::array<double, 3>> marker;  // of model 2, by number
};

std::map<std::uint32_t, Printed> printed_frames(const std::filesystem::path& path) {
  std::map<std::uint32_t, Printed> frames;
  Printed* frame = nullptr;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    unsigned number = 0;
    int model = 0;
    int marker = 0;
    std::array<double, 7> v{};
    if (std::sscanf(line.c_str(), "FrameID : %u", &number) == 1) {
      frame = &frames[number];
    } else if (frame != nullptr &&
               std::sscanf(line.c_str(), " %lf %lf %lf %lf %lf %lf %lf", v.data(), &v[1], &v[2],
                           &v[3], &v[4], &v[5], &v[6]) == 7) {
      frame->body = v;
    } else if (frame != nullptr &&
               std::sscanf(line.c_str(),
                           "Labeled Marker [ModelID=%d, MarkerID=%d, Occluded=%*d, PCSolved=%*d, "
                           "ModelSolved=%*d] [size=%*f] [pos=%lf,%lf,%lf]",
                           &model, &marker, v.data(), &v[1], &v[2]) == 5 &&
               model == 2) {
      frame->marker[marker] = {v[0], v[1], v[2]};
    }
  }
  return frames;
}

}  // namespace

TEST_CASE("the recorded NatNet session as the vendor's own client printed it") {
  const auto folder = test::shared(kSession);
  if (!folder) SKIP_WITHOUT_SHARED();
  const RecordedSession session(*folder);
  const auto printed = printed_frames(*folder / "raw/SampleClient_output.txt");
  NatNetRig rig;
  introduce(rig, session);
  constexpr double kRounding = 0.005001;
  int compared = 0;
  for (const NatNetBytes& bytes : session.frames) {
    REQUIRE(rig.feed(bytes) == Outcome::kOk);
    const auto same = printed.find(value_at<std::uint32_t>(bytes, 4));
    if (same == printed.end() || same->second.marker.size() != 5) continue;
    ++compared;
    const Frame& frame = rig.sink.frames.back();
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(static_cast<double>(frame.root_position_m[i]) ==
            Approx(same->second.body[i]).margin(kRounding));
    }
    for (std::size_t i = 0; i < 4; ++i) {
      CHECK(static_cast<double>(frame.rotation_xyzw[0][i]) ==
            Approx(same->second.body[3 + i]).margin(kRounding));
    }
    for (const auto& [number, position_m] : same->second.marker) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto value = static_cast<std::size_t>(number - 1) * 3 + i;
        CHECK(static_cast<double>(rig.sink.samples.back().value[value]) ==
              Approx(position_m[i]).margin(kRounding));
      }
    }
  }
  CHECK(compared == kPrintedFrames);
}

TEST_CASE("recorded NatNet packets with a marker that the cameras do not see") {
  const auto folder = test::shared(kSession);
  if (!folder) SKIP_WITHOUT_SHARED();
  NatNetRig rig;
  REQUIRE(rig.feed(file_bytes(*folder / "serverinfo_packet_v3.bin")) == Outcome::kOk);
  REQUIRE(rig.feed(file_bytes(*folder / "modeldef_packet_v3.bin")) == Outcome::kOk);
  CHECK(rig.feed(file_bytes(*folder / "mocapframe_packet_v3.bin")) == Outcome::kOk);
  CHECK(rig.feed(file_bytes(*folder / "echoresponse_packet_v3.bin")) == Outcome::kOk);
  for (const char* name : {"connect_packet_v3.bin", "discovery_packet_v3.bin",
                           "echorequest_packet_v3.bin", "requestmodeldef_packet_v3.bin"}) {
    CHECK(rig.feed(file_bytes(*folder / name)) == Outcome::kForeign);
  }
  // This packet has other models: it is read to its end, and its bodies are unknown.
  const NatNetBytes occluded = file_bytes(*folder / "mocapframe_packet_occluded_v3.bin");
  natnet::FrameView view;
  REQUIRE(natnet::read_frame(std::span(occluded).subspan(4), {.version = {3, 0}}, view));
  ByteReader reader(view.labelled.bytes);
  bool any = false;
  for (std::size_t i = 0; i < view.labelled.count; ++i) {
    natnet::LabelledMarker marker;
    REQUIRE(natnet::read_labelled(reader, {.version = {3, 0}}, marker));
    any = any || marker.occluded;
  }
  CHECK(any);
}

TEST_CASE("recorded NatNet packets of Motive 1.5, 1.7 and 1.9") {
  const auto folder = test::shared(kOldFrames);
  if (!folder) SKIP_WITHOUT_SHARED();
  struct Old {
    std::string motive;
    natnet::Version version;
    std::string name;
    std::int32_t id;
    std::size_t position;  // of the rigid body, in the datagram
  };
  const std::vector<Old> all{{"1.5.0", {2, 5}, "Rigid Body 1", 1, 0x91},
                             {"1.7.2", {2, 7}, "Rigid Body 1", 1, 0x91},
                             {"1.9.0", {2, 9}, "Triangle", 2, 0x75}};
  for (const Old& old : all) {
    for (const bool reported : {true, false}) {
      INFO(old.motive << (reported ? " with" : " without") << " its ServerInfo");
      NatNetRig rig;
      const auto packet = [&](const char* number) {
        return file_bytes(*folder / ("frame-motive-" + old.motive + '-' + number + ".bin"));
      };
      if (reported) REQUIRE(rig.feed(packet("000")) == Outcome::kOk);
      natnet::ModelDef model;
      model.markers[old.name] = 3;
      model.bodies.push_back(
          {.name = old.name, .id = old.id, .bones = {{.name = old.name, .id = old.id}}});
      REQUIRE(rig.feed(natnet::encode_model_def(model, old.version)) == Outcome::kOk);
      for (const char* number : {"001", "002"}) {
        const NatNetBytes bytes = packet(number);
        REQUIRE(rig.feed(bytes) == Outcome::kOk);
        const Frame& frame = rig.sink.frames.back();
        CHECK(frame.root_position_m == vector_at(bytes, old.position));
        CHECK(static_cast<double>(frame.rotation_xyzw[0][3]) ==
              Approx(static_cast<double>(value_at<float>(bytes, old.position + 24))).margin(1e-6));
        CHECK(frame.header.device_ns > 0);
      }
      // Only 1.9 says whose a labelled marker is; its first one also leads the marker set.
      REQUIRE(rig.sink.samples.size() == (old.motive == "1.9.0" ? 2 : 0));
      if (rig.sink.samples.empty()) continue;
      const Vec3f first_m = vector_at(packet("002"), 4 + 4 + 4 + 9 + 4);
      for (std::size_t i = 0; i < 3; ++i) CHECK(rig.sink.samples[1].value[i] == first_m[i]);
    }
  }
}

}  // namespace posed::drivers
