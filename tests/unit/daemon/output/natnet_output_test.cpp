// The NatNet output as a server on real sockets of this machine, on a virtual clock: handshake,
// versions, clients that come and go, and what posed's own driver makes of the frames.
#include "daemon/output/natnet_output.hpp"

#include <poll.h>

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "drivers/byte_writer.hpp"
#include "drivers/natnet/emulator.hpp"
#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "tests/support/pcapng.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/daemon/output/protocol_link.hpp"

namespace posed::output {
namespace {

namespace natnet = drivers::natnet;
using natnet::MessageId;
using natnet::Version;
using Datagram = std::vector<std::byte>;

config::OutputConfig natnet_config(std::vector<std::string> people) {
  config::OutputConfig config;
  config.kind = config::OutputKind::kNatNet;
  config.bodies = std::move(people);
  config.listen = "127.0.0.1:0";
  return config;
}

// What vendor's clients of SDK 4 send: a name, and behind two versions the one that they want.
Datagram connect_datagram(Version wanted) {
  drivers::ByteWriter writer;
  writer.text("Ping");
  while (writer.size() < 265) writer.u8(0);
  writer.u8(wanted.major);
  writer.u8(wanted.minor);
  while (writer.size() < 271) writer.u8(0);
  return natnet::encode_message(MessageId::kConnect, writer.finish());
}

struct NatNetServerRig : OutputRig {
  explicit NatNetServerRig(const config::OutputConfig& config) : OutputRig(config) {}
  [[nodiscard]] std::string endpoint() const {
    return static_cast<const NatNetOutput&>(*output).endpoint();
  }
  // Lets it work when a datagram has come, which a busy kernel delivers a little later.
  void turn_when_asked() const {
    pollfd ready{.fd = output->poll_fd(), .events = POLLIN, .revents = 0};
    REQUIRE(::poll(&ready, 1, 5000) == 1);
    static_cast<void>(output->turn(now_ns));
  }
  std::int64_t now_ns = kNanosPerSecond;
};

// A program that speaks to the server.
struct NatNetClient {
  explicit NatNetClient(const NatNetServerRig& rig)
      : server(rig),
        socket(drivers::UdpTransport::open(
                   {.sockets = {{.listen = "127.0.0.1:0", .to = rig.endpoint()}}})
                   .value()) {}
  void send(const Datagram& datagram) const {
    REQUIRE(socket->send(datagram, 0));
    server.turn_when_asked();
  }
  // The next datagram; empty: none comes.
  [[nodiscard]] Datagram next(int wait_ms = 5000) const {
    pollfd ready{.fd = socket->poll_fd(), .events = POLLIN, .revents = 0};
    (void)::poll(&ready, 1, wait_ms);
    const drivers::Chunk chunk = socket->read(0);
    return {chunk.bytes.begin(), chunk.bytes.end()};
  }
  // Asks and returns what comes.
  [[nodiscard]] Datagram ask(const Datagram& datagram) const {
    send(datagram);
    return next();
  }
  // Asks for frames, and returns the version that the server gives.
  [[nodiscard]] Version connect(Version wanted) const {
    const Datagram answer = ask(connect_datagram(wanted));
    natnet::Message message;
    natnet::ServerInfo info;
    REQUIRE(natnet::decode_message(answer, message) == Outcome::kOk);
    REQUIRE(message.id == MessageId::kServerInfo);
    REQUIRE(natnet::decode_server_info(message.payload, info));
    return info.version;
  }

  const NatNetServerRig& server;
  std::unique_ptr<drivers::UdpTransport> socket;
};

MessageId id_of(const Datagram& datagram) {
  natnet::Message message;
  REQUIRE(natnet::decode_message(datagram, message) == Outcome::kOk);
  return message.id;
}

// Whether it is a frame of exactly this version.
bool is_frame_of(const Datagram& datagram, Version version) {
  natnet::Message message;
  natnet::FrameView view;
  return natnet::decode_message(datagram, message) == Outcome::kOk &&
         message.id == MessageId::kFrame &&
         natnet::read_frame(message.payload, {.version = version}, view);
}

double timestamp_of(const Datagram& datagram) {
  natnet::Message message;
  natnet::FrameView view;
  REQUIRE(natnet::decode_message(datagram, message) == Outcome::kOk);
  REQUIRE(natnet::read_frame(message.payload, {.version = {4, 1}}, view));
  return view.timestamp_s;
}

}  // namespace

TEST_CASE("people and props of Motive arrive through the NatNet output as they were") {
  natnet::NatNetEmulator emulator{natnet::Settings{}};
  NatNetServerRig rig(natnet_config({"emma", "wand"}));
  const NatNetClient client(rig);
  ProtocolReader first("natnet"), second("natnet");
  Apart worst;
  int compared = 0;
  std::vector<std::shared_ptr<const Skeleton>> known(2);
  constexpr std::array<std::int32_t, 2> kNumbers{7, 40};
  for (int i = 0; i < 200; ++i) {
    rig.now_ns += kNanosPerSecond / 120;
    // posed's own driver asks what it needs.
    const drivers::Request request = second.decoder().next_request(rig.now_ns);
    if (!request.bytes.empty()) {
      client.send({request.bytes.begin(), request.bytes.end()});
      for (Datagram answer = client.next(0); !answer.empty(); answer = client.next(0)) {
        second.feed(answer, rig.now_ns);
      }
    }
    Datagram bytes;
    emulator.emit(emulator.next_due_ns(), bytes);
    first.feed(bytes, rig.now_ns);
    if (first.bodies().empty()) continue;
    for (std::size_t b = 0; b < 2; ++b) {
      const drivers::Body& body = first.bodies()[b];
      if (known[b] == body.skeleton) continue;
      known[b] = body.skeleton;
      auto info = info_of(static_cast<std::uint32_t>(b), b == 0 ? "emma" : "wand", body.skeleton);
      info.number = kNumbers[b];
      rig.output->stream_comes(info);
    }
    if (first.newest.size() < 2) continue;
    const auto sent = rig.stats().sent();
    for (std::size_t b = 0; b < 2; ++b) {
      Frame frame = frame_of(static_cast<std::uint32_t>(b), first.newest[first.bodies()[b].name]);
      frame.header.arrival_ns = rig.now_ns;
      rig.pass(frame, rig.now_ns);
    }
    if (rig.stats().sent() > sent) second.feed(client.next(), rig.now_ns);
    if (second.newest.size() < 2) continue;
    for (std::size_t b = 0; b < 2; ++b) {
      const std::string& name = first.bodies()[b].name;
      REQUIRE(second.skeleton(name) != nullptr);
      CHECK(second.body(name)->number == kNumbers[b]);
      REQUIRE(same_figure(*known[b], *second.skeleton(name), worst));
      compare(*known[b], first.newest[name], second.newest[name], worst);
      CHECK(first.newest[name].valid == second.newest[name].valid);
      ++compared;
    }
  }
  CHECK(compared > 200);
  CHECK(worst.rad < 1e-5);
  CHECK(worst.m < 1e-5);
  CHECK(worst.timecodes == 0);
  CHECK(second.damage == "");
  CHECK(rig.reported.empty());
}

TEST_CASE("sixteen people at 120 Hz arrive through NatNet of each version", "[.crowd]") {
  const Crowd crowd("natnet", {});
  const auto names = Crowd::names();
  for (const Version version : {Version{2, 9}, {2, 10}, {3, 0}, {3, 1}, {4, 0}, {4, 1}}) {
    const std::string text = std::to_string(version.major) + "." + std::to_string(version.minor);
    NatNetServerRig rig(natnet_config(names));
    const NatNetClient client(rig);
    ProtocolReader reader("natnet", {{"version", text}});
    for (int i = 0; i < kCrowd; ++i) {
      rig.output->stream_comes(
          info_of(static_cast<std::uint32_t>(i), names[i], crowd.named(names[i])));
    }
    CHECK(client.connect(version) == version);
    reader.feed(client.ask(natnet::encode_message(MessageId::kRequestModelDef, {})), rig.now_ns);
    REQUIRE(reader.bodies().size() == kCrowd);
    CrowdCheck check;
    for (int step = 0; step < 360; ++step) {
      rig.now_ns += kNanosPerSecond / 120;
      const auto before = rig.stats().sent();
      check.pass(rig, crowd, kCrowd, step, rig.now_ns);
      std::vector<std::vector<std::byte>> datagrams;
      for (auto sent = rig.stats().sent(); sent > before; --sent)
        datagrams.push_back(client.next());
      for (const auto& datagram : datagrams) reader.feed(datagram, rig.now_ns);
      check.send_alone(datagrams, kCrowd);
      // The first frame goes out with the first person that is there.
      if (step > 0) check.compare_with(crowd, reader, kCrowd, step, names);
      reader.newest.clear();
    }
    check.show("natnet " + text);
    CHECK(reader.damage == "");
    CHECK(rig.reported.empty());
  }
}

TEST_CASE("any other person is sent by the NatNet output as Motive's figure") {
  const auto walk = motion::make_walker({.seconds = 1.0, .rate_hz = 60.0}).value();
  const auto canonical = motion::canonical_skeleton(*walk.skeleton).value();
  const auto to_canonical = motion::Retarget::bind(walk.skeleton, canonical).value();
  NatNetServerRig rig(natnet_config({"ann"}));
  const NatNetClient client(rig);
  ProtocolReader reader("natnet");
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  reader.feed(client.ask(connect_datagram({3, 1})), rig.now_ns);
  reader.feed(client.ask(natnet::encode_message(MessageId::kRequestModelDef, {})), rig.now_ns);
  REQUIRE(reader.skeleton("ann") != nullptr);
  CHECK(reader.skeleton("ann")->joint_index("LUArm") >= 0);
  const auto back = motion::Retarget::bind(reader.skeleton("ann"), canonical).value();
  double worst_rad = 0.0;
  for (int i = 0; i < 60; ++i) {
    rig.now_ns += kNanosPerSecond / 60;
    Frame frame = frame_of(0, walk.frame(i));
    frame.header.arrival_ns = rig.now_ns;
    rig.pass(frame, rig.now_ns);
    reader.feed(client.next(), rig.now_ns);
    REQUIRE(reader.newest.contains("ann"));
    Frame expected, arrived;
    to_canonical.apply(frame, expected);
    back.apply(reader.newest["ann"], arrived);
    for (std::size_t j = 0; j < canonical->joints.size(); ++j) {
      if (!arrived.valid[j]) continue;
      worst_rad =
          std::max(worst_rad, angle_between_rad(to_eigen_double(arrived.rotation_xyzw[j]),
                                                to_eigen_double(expected.rotation_xyzw[j])));
    }
  }
  CHECK(worst_rad < 1e-5);
}

TEST_CASE("each NatNet client gets frames of the version that it asks for, or the nearest") {
  const auto walk = motion::make_walker({.seconds = 1.0}).value();
  NatNetServerRig rig(natnet_config({"ann"}));
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  const NatNetClient old(rig), unknown(rig), changing(rig), plain(rig);
  CHECK(old.connect({2, 9}) == Version{2, 9});
  CHECK(unknown.connect({9, 9}) == Version{4, 1});
  CHECK(changing.connect({3, 7}) == Version{3, 1});
  CHECK(id_of(plain.ask(natnet::encode_text(MessageId::kConnect, "Ping"))) ==
        MessageId::kServerInfo);
  CHECK(id_of(changing.ask(natnet::encode_text(MessageId::kRequest, "Bitstream,4.0"))) ==
        MessageId::kResponse);
  rig.pass(frame_of(0, walk.frame(0)), rig.now_ns);
  CHECK(is_frame_of(old.next(), {2, 9}));
  CHECK(is_frame_of(unknown.next(), {4, 1}));
  CHECK(is_frame_of(changing.next(), {4, 0}));
  CHECK(is_frame_of(plain.next(), {4, 1}));
  CHECK(rig.stats().receivers() == 4);
}

TEST_CASE("a NatNet group and who asks beside it get the version of the config") {
  const auto walk = motion::make_walker({.seconds = 1.0}).value();
  config::OutputConfig config = natnet_config({"ann"});
  config.group = "239.255.42.99";
  config.version = "3.0";
  NatNetServerRig rig(config);
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  const NatNetClient client(rig);
  CHECK(client.connect({4, 1}) == Version{3, 0});
  client.send(natnet::encode_message(MessageId::kKeepAlive, {}));
  rig.pass(frame_of(0, walk.frame(0)), rig.now_ns);
  CHECK(is_frame_of(client.next(), {3, 0}));
}

TEST_CASE("a NatNet server answers the recorded requests of the vendor's client as Motive did") {
  const auto recorded = [](const std::string& name) {
    return test::shared("data/streams/natnet_python_natnet/" + name + "_packet_v3.bin");
  };
  if (!recorded("connect")) SKIP_WITHOUT_SHARED();
  NatNetServerRig rig(natnet_config({"ann"}));
  const NatNetClient client(rig);
  for (const auto& [asked, answered] : {std::pair{"discovery", "serverinfo"},
                                        {"connect", "serverinfo"},
                                        {"echorequest", "echoresponse"},
                                        {"requestmodeldef", "modeldef"}}) {
    INFO(asked);
    const Datagram expected = test::file_bytes(*recorded(answered));
    const Datagram answer = client.ask(test::file_bytes(*recorded(asked)));
    CHECK(id_of(answer) == id_of(expected));
    if (answered != std::string_view("modeldef")) CHECK(answer.size() == expected.size());
  }
  const auto walk = motion::make_walker({.seconds = 1.0}).value();
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  rig.pass(frame_of(0, walk.frame(0)), rig.now_ns);
  CHECK(is_frame_of(client.next(), {3, 0}));  // the client's own version
}

TEST_CASE("a NatNet client that leaves or is silent gets nothing any more") {
  const auto walk = motion::make_walker({.seconds = 1.0}).value();
  NatNetServerRig rig(natnet_config({"ann"}));
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  const NatNetClient polite(rig), silent(rig), alive(rig);
  for (const NatNetClient* client : {&polite, &alive}) (void)client->connect({4, 1});
  (void)silent.connect({3, 0});
  polite.send(natnet::encode_message(MessageId::kDisconnect, {}));
  rig.now_ns += NatNetOutput::kSilent_ns / 2;
  alive.send(natnet::encode_message(MessageId::kKeepAlive, {}));
  rig.now_ns += NatNetOutput::kSilent_ns / 2 + 1;
  rig.pass(frame_of(0, walk.frame(0)), rig.now_ns);
  CHECK(id_of(alive.next()) == MessageId::kFrame);
  CHECK(polite.next(0).empty());
  CHECK(silent.next(0).empty());
  CHECK(rig.stats().receivers() == 1);
  // One that is heard again goes on in its version; one that never said a version gets nothing.
  const NatNetClient stranger(rig);
  for (const NatNetClient* client : {&silent, &stranger}) {
    client->send(natnet::encode_message(MessageId::kKeepAlive, {}));
  }
  rig.pass(frame_of(0, walk.frame(1)), rig.now_ns);
  CHECK(is_frame_of(silent.next(), {3, 0}));
  CHECK(stranger.next(0).empty());
}

TEST_CASE("what a NatNet server sends never goes back in time") {
  const auto walk = motion::make_walker({.seconds = 1.0}).value();
  NatNetServerRig rig(natnet_config({"ann"}));
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  const NatNetClient client(rig);
  (void)client.connect({4, 1});
  Frame newer = frame_of(0, walk.frame(1)), older = frame_of(0, walk.frame(0));
  newer.header.arrival_ns = rig.now_ns + kNanosPerSecond;
  older.header.arrival_ns = rig.now_ns;
  older.quality = Quality::kStale;
  const auto time_s = [&](const Frame& frame) {
    rig.pass(frame, rig.now_ns);
    return timestamp_of(client.next());
  };
  const double first_s = time_s(newer);
  CHECK(time_s(older) >= first_s);
}

TEST_CASE("a NatNet server limits its clients, and answers no damaged request") {
  NatNetServerRig rig(natnet_config({"ann"}));
  std::vector<std::unique_ptr<NatNetClient>> clients;
  for (std::size_t i = 0; i <= NatNetOutput::kMaxClients; ++i) {
    clients.push_back(std::make_unique<NatNetClient>(rig));
    (void)clients.back()->connect({4, 1});
  }
  CHECK(rig.stats().receivers() == NatNetOutput::kMaxClients);
  REQUIRE(rig.reported.size() == 1);
  CHECK(rig.reported[0] ==
        "output test: 127.0.0.1 was refused: there are 16 clients, the most there may be");
  const NatNetClient& client = *clients.front();
  Datagram lies = connect_datagram({4, 1});
  lies.resize(100);  // shorter than it says
  client.send(lies);
  client.send(Datagram(3));
  client.send(Datagram(4000, std::byte{14}));
  client.send(natnet::encode_message(MessageId::kEchoRequest, {}));
  CHECK(client.next(0).empty());
  // The vendor's client for Python ends its requests with a byte more than they say.
  Datagram longer = natnet::encode_message(MessageId::kRequestModelDef, {});
  longer.push_back(std::byte{0});
  CHECK(id_of(client.ask(longer)) == MessageId::kModelDef);
  CHECK(id_of(client.ask(natnet::encode_text(MessageId::kRequest, "Reboot"))) ==
        MessageId::kUnrecognized);
}

TEST_CASE("a NatNet server answers nobody whom the config does not name") {
  config::OutputConfig config = natnet_config({"ann"});
  config.peers = {"192.0.2.1"};
  NatNetServerRig rig(config);
  const NatNetClient client(rig);
  client.send(connect_datagram({4, 1}));
  CHECK(client.next(0).empty());
  CHECK(rig.stats().receivers() == 0);
}

TEST_CASE("poses of two streams that come together go out as one, and nobody waits for long") {
  constexpr std::int64_t kPeriod_ns = 10'000'000;
  Gathering gathering(2);
  CHECK(gathering.comes(0, 0));  // the other one has never come
  CHECK_FALSE(gathering.comes(1, 1000));
  CHECK(gathering.due_ns() == 1000 + Gathering::kMoment_ns);
  CHECK(gathering.is_late(1000 + Gathering::kMoment_ns));
  gathering.sent();
  CHECK_FALSE(gathering.comes(0, kPeriod_ns));
  CHECK(gathering.comes(1, kPeriod_ns + 1000));
  CHECK(gathering.due_ns() == kNoTime_ns);
  CHECK_FALSE(gathering.comes(0, 2 * kPeriod_ns));
  CHECK(gathering.comes(0, 2 * kPeriod_ns + 1000));                 // again: it waits no longer
  CHECK(gathering.comes(0, 2 * kPeriod_ns + kNanosPerSecond / 2));  // the other one is silent
}

}  // namespace posed::output
