// The outputs that only send, as the programs of the protocols do: from frames to datagrams on real
// sockets, on a virtual clock, to posed's own decoders.

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/output/udp_receivers.hpp"
#include "drivers/rokoko/decoder.hpp"
#include "drivers/rokoko/encode.hpp"
#include "models/motion/canonical_skeleton.hpp"
#include "models/motion/retarget.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "tests/support/pcapng.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/daemon/output/protocol_link.hpp"

namespace posed::output {
namespace {

using config::OutputKind;

struct Protocol {
  OutputKind kind{};
  std::vector<std::string> people{};  // of the emulator
  drivers::Options options{};
  bool euler = false, lz4 = false, binary = false;
};

config::OutputConfig protocol_config(const Protocol& protocol, const UdpReceiver& receiver) {
  config::OutputConfig config;
  config.kind = protocol.kind;
  config.bodies = protocol.people;
  config.to = {receiver.endpoint()};
  config.euler = protocol.euler;
  config.lz4 = protocol.lz4;
  return config;
}

// The protocol's emulator -> posed -> the same protocol -> posed.
void check_round_trip(const Protocol& protocol) {
  const std::string driver(config::kind_name(protocol.kind));
  INFO(driver);
  const auto emulator = drivers::find_driver(driver)->emulate(protocol.options).value();
  ProtocolReader first(driver), second(driver);
  UdpReceiver receiver;
  const OutputRig rig(protocol_config(protocol, receiver));
  std::vector<std::shared_ptr<const Skeleton>> known(protocol.people.size());
  Apart worst;
  int compared = 0;
  while (emulator->next_due_ns() < 3 * kNanosPerSecond) {
    const std::int64_t now_ns = emulator->next_due_ns();
    std::vector<std::byte> bytes;
    emulator->emit(now_ns, bytes);
    first.feed(bytes, now_ns);
    for (std::size_t i = 0; i < protocol.people.size(); ++i) {
      const std::string& name = protocol.people[i];
      const auto id = static_cast<std::uint32_t>(i);
      if (const auto skeleton = first.skeleton(name); skeleton != nullptr && skeleton != known[i]) {
        rig.output->stream_comes(info_of(id, name, skeleton));
        known[i] = skeleton;
      }
      if (!first.newest.contains(name)) continue;
      Frame frame = frame_of(id, first.newest[name]);
      frame.header.arrival_ns = now_ns;
      rig.pass(frame, now_ns);
    }
    for (const auto& datagram : receiver.received(rig.sent())) second.feed(datagram, now_ns);
    for (std::size_t i = 0; i < protocol.people.size(); ++i) {
      const std::string& name = protocol.people[i];
      if (!first.newest.contains(name) || !second.newest.contains(name)) continue;
      // Its fingers may not be known yet.
      if (!same_figure(*known[i], *second.skeleton(name), worst)) continue;
      compare(*known[i], first.newest[name], second.newest[name], worst);
      ++compared;
    }
    first.newest.clear();
  }
  CHECK(compared > 100 * static_cast<int>(protocol.people.size()));
  CHECK(worst.rad < 1e-5);
  CHECK(worst.m < 1e-5);
  CHECK(worst.timecodes == 0);
  CHECK(second.damage == "");
  CHECK(rig.reported.empty());
}

// Sixteen people at 120 Hz for three seconds, on a virtual clock.
void check_crowd(const Protocol& protocol, const std::string& what, int people = kCrowd) {
  const std::string driver(config::kind_name(protocol.kind));
  const Crowd crowd(driver, protocol.options);
  ProtocolReader reader(driver);
  UdpReceiver receiver;
  Protocol many = protocol;
  many.people = Crowd::names(people);
  config::OutputConfig config = protocol_config(many, receiver);
  config.binary = protocol.binary;
  const OutputRig rig(config);
  for (int i = 0; i < people; ++i) {
    rig.output->stream_comes(
        info_of(static_cast<std::uint32_t>(i), many.people[i], crowd.named(many.people[i])));
  }
  // mocopi's one performer has no name.
  const auto names = people == 1 ? std::vector<std::string>{"mocopi"} : many.people;
  CrowdCheck check;
  constexpr int kStart = 120;  // describes the people: some protocols do so each second only
  for (int step = 0; step < kStart + 360; ++step) {
    const std::int64_t now_ns = kNanosPerSecond + step * kNanosPerSecond / 120;
    check.pass(rig, crowd, people, step, now_ns);
    const auto datagrams = receiver.received(rig.sent());
    for (const auto& datagram : datagrams) reader.feed(datagram, now_ns);
    check.send_alone(datagrams, people);
    if (step >= kStart) check.compare_with(crowd, reader, people, step, names);
  }
  check.show(what);
  CHECK(reader.damage == "");
  CHECK(rig.reported == std::vector<std::string>{});
}

// Another person: each bone that both have points to where the walker's does.
void check_walker(const Protocol& protocol) {
  const std::string driver(config::kind_name(protocol.kind));
  INFO(driver);
  const auto walk = motion::make_walker({.seconds = 2.0, .rate_hz = 60.0}).value();
  const auto canonical = motion::canonical_skeleton(*walk.skeleton).value();
  const auto to_canonical = motion::Retarget::bind(walk.skeleton, canonical).value();
  ProtocolReader reader(driver);
  UdpReceiver receiver;
  Protocol one = protocol;
  one.people = {"ann"};
  const OutputRig rig(protocol_config(one, receiver));
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton));
  double worst_rad = 0.0, worst_m = 0.0;
  int compared = 0;
  for (int i = 0; i < 120; ++i) {
    const std::int64_t now_ns = i * kNanosPerSecond / 60;
    Frame frame = frame_of(0, walk.frame(i));
    frame.header.arrival_ns = now_ns;
    frame.header.sequence = static_cast<std::uint64_t>(i) + 1;
    rig.pass(frame, now_ns);
    for (const auto& datagram : receiver.received(rig.sent())) reader.feed(datagram, now_ns);
    if (reader.newest.empty()) continue;
    const auto& [name, got] = *reader.newest.begin();
    Frame expected, arrived;
    to_canonical.apply(frame, expected);
    const auto back = motion::Retarget::bind(reader.skeleton(name), canonical).value();
    back.apply(got, arrived);
    for (std::size_t j = 0; j < canonical->joints.size(); ++j) {
      if (!arrived.valid[j]) continue;
      worst_rad =
          std::max(worst_rad, angle_between_rad(to_eigen_double(arrived.rotation_xyzw[j]),
                                                to_eigen_double(expected.rotation_xyzw[j])));
      ++compared;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      worst_m = std::max(worst_m, std::abs(static_cast<double>(arrived.root_position_m[k]) -
                                           static_cast<double>(expected.root_position_m[k])));
    }
  }
  CHECK(compared > 1000);
  CHECK(worst_rad < 1e-5);
  CHECK(worst_m < 1e-3);
}

}  // namespace

TEST_CASE("people of MVN arrive through the MVN output as they were") {
  check_round_trip({.kind = OutputKind::kMvn,
                    .people = {"Walker", "Waver"},
                    .options = {{"types", std::string("25 02 12 13")}}});
  check_round_trip({.kind = OutputKind::kMvn, .people = {"Walker", "Waver"}, .euler = true});
}

TEST_CASE("a recorded person of MVN arrives through the MVN output as they were") {
  const auto recorded = [](const char* type) {
    return test::shared(std::string("data/streams/xsens_mxtp/mxtp") + type + ".bin");
  };
  if (!recorded("02") || !recorded("12") || !recorded("13")) SKIP_WITHOUT_SHARED();
  for (const bool euler : {false, true}) {
    ProtocolReader first("mvn"), second("mvn");
    for (const char* type : {"12", "13", "02"}) first.feed(test::file_bytes(*recorded(type)), 0);
    auto again = test::file_bytes(*recorded("02"));
    again[9] = static_cast<std::byte>(std::to_integer<unsigned>(again[9]) + 1);  // the next sample
    first.feed(again, 0);
    REQUIRE(first.newest.contains("Factory"));
    UdpReceiver receiver;
    const OutputRig rig(protocol_config(
        {.kind = OutputKind::kMvn, .people = {"performer"}, .euler = euler}, receiver));
    rig.output->stream_comes(info_of(0, "performer", first.skeleton("Factory")));
    for (int i = 0; i < 2; ++i) {  // the first pose is part of the description
      rig.pass(frame_of(0, first.newest["Factory"]), i);
      for (const auto& datagram : receiver.received(rig.sent())) second.feed(datagram, i);
    }
    REQUIRE(second.newest.contains("Factory"));
    Apart worst;
    CHECK(same_figure(*first.skeleton("Factory"), *second.skeleton("Factory"), worst));
    compare(*first.skeleton("Factory"), first.newest["Factory"], second.newest["Factory"], worst);
    CHECK(worst.rad < 1e-5);
    CHECK(worst.m < 1e-5);
  }
}

TEST_CASE("any other person arrives through the MVN output with their bones' directions") {
  check_walker({.kind = OutputKind::kMvn});
  check_walker({.kind = OutputKind::kMvn, .euler = true});
}

TEST_CASE("a person of mocopi arrives through the mocopi output as they were") {
  check_round_trip({.kind = OutputKind::kMocopi, .people = {"mocopi"}});
}

TEST_CASE("actors and props of Rokoko Studio arrive through its output as they were") {
  for (const bool lz4 : {false, true}) {
    check_round_trip({.kind = OutputKind::kRokoko, .people = {"Anna", "Ben", "Sword"}, .lz4 = lz4});
  }
}

TEST_CASE("an actor's face goes on through the Rokoko output") {
  namespace rokoko = drivers::rokoko;
  UdpReceiver receiver;
  const OutputRig rig(
      protocol_config({.kind = OutputKind::kRokoko, .people = {"ann"}, .lz4 = false}, receiver));
  const auto walk = motion::make_walker({.seconds = 1.0}).value();
  drivers::SampleLayout face;
  for (std::size_t i = 0; i < rokoko::kFaceValues; ++i) {
    face.names.emplace_back(rokoko::face_value_name(i));
    face.units.emplace_back("1");
  }
  rig.output->stream_comes(info_of(0, "ann", walk.skeleton, face));
  Sample sample;
  sample.value_count = rokoko::kFaceValues;
  sample.value[17] = 0.25F;
  sample.valid.set(17);
  rig.output->sample(sample);
  static_cast<void>(rig.output->turn(0));
  rig.pass(frame_of(0, walk.frame(0)), 1);
  const auto datagrams = receiver.received(rig.sent());
  REQUIRE(datagrams.size() == 1);
  const std::string_view text(reinterpret_cast<const char*>(datagrams[0].data()),
                              datagrams[0].size());
  CHECK(text.find("\"hasFace\":true") != std::string_view::npos);
  CHECK(text.find("\"jawOpen\":25,") != std::string_view::npos);
  CHECK(text.find("\"jawForward\":0,") != std::string_view::npos);
}

TEST_CASE("Rokoko's receivers are told how high an actor stands, by which they scale") {
  namespace rokoko = drivers::rokoko;
  UdpReceiver receiver;
  const OutputRig rig(
      protocol_config({.kind = OutputKind::kRokoko, .people = {"ann \"A\""}}, receiver));
  const auto person = rokoko::average_person("ann", rokoko::without_fingers(), 2.0F);
  rig.output->stream_comes(info_of(0, "ann \"A\"", rokoko::skeleton_of(person, "ann").value()));
  rig.pass(frame_of(0, {}), 0);
  const auto datagrams = receiver.received(1);
  REQUIRE(datagrams.size() == 1);
  const std::string_view text(reinterpret_cast<const char*>(datagrams[0].data()),
                              datagrams[0].size());
  const auto actor = nlohmann::json::parse(text)["scene"]["actors"][0];
  CHECK(actor["dimensions"]["hipHeight"].get<double>() == Approx(1.9).margin(0.01));
  CHECK(actor["dimensions"]["totalHeight"].get<double>() == Approx(3.33).margin(0.1));
  CHECK(actor["meta"]["hasGloves"] == false);
}

TEST_CASE("any other person arrives through the outputs of mocopi and Rokoko") {
  check_walker({.kind = OutputKind::kMocopi});
  check_walker({.kind = OutputKind::kRokoko, .lz4 = true});
}

TEST_CASE("two people of one name go out under two names") {
  for (const OutputKind kind : {OutputKind::kMvn, OutputKind::kRokoko}) {
    const std::string driver(config::kind_name(kind));
    INFO(driver);
    const Crowd crowd(driver, {});
    ProtocolReader reader(driver);
    UdpReceiver receiver;
    const OutputRig rig(protocol_config({.kind = kind, .people = {"one", "two"}}, receiver));
    for (const std::uint32_t id : {0U, 1U}) {
      rig.output->stream_comes(info_of(id, id == 0 ? "one" : "two", crowd.skeleton));
    }
    for (int step = 0; step < 90; ++step) {  // people are described each second
      const std::int64_t now_ns = step * kNanosPerSecond / 60;
      for (const int person : {0, 1}) {
        Frame pose = crowd.pose(person, step);
        pose.header.arrival_ns = now_ns;
        rig.output->frame(pose);
      }
      static_cast<void>(rig.output->turn(now_ns));
      for (const auto& datagram : receiver.received(rig.sent())) reader.feed(datagram, now_ns);
    }
    CHECK(reader.newest.size() == 2);
    CHECK(reader.newest.contains(crowd.skeleton->name));
    CHECK(reader.newest.contains("two"));
  }
}

TEST_CASE("sixteen people at 120 Hz arrive through each output as they were", "[.crowd]") {
  check_crowd({.kind = OutputKind::kMvn}, "mvn quaternion");
  check_crowd({.kind = OutputKind::kMvn, .euler = true}, "mvn Euler");
  check_crowd({.kind = OutputKind::kAxis}, "axis text");
  check_crowd({.kind = OutputKind::kAxis, .binary = true}, "axis binary");
  check_crowd({.kind = OutputKind::kRokoko}, "rokoko", 6);  // plain text of more is no datagram
  check_crowd({.kind = OutputKind::kRokoko, .lz4 = true}, "rokoko LZ4");
  for (int i = 0; i < kCrowd; ++i) {
    check_crowd({.kind = OutputKind::kMocopi}, "mocopi " + std::to_string(i + 1), 1);
  }
}

TEST_CASE("of datagrams that go out together each is counted and in its place") {
  UdpReceiver receiver;
  std::string dead;
  {
    const UdpReceiver gone;
    dead = gone.endpoint();
  }
  auto receivers = UdpReceivers::open({dead, receiver.endpoint()}).value();
  const auto pass = [&](std::size_t bytes_of_second, std::int64_t now_ns) {
    Datagrams datagrams;
    for (std::size_t i = 0; i < 40; ++i) {
      const std::vector<std::byte> bytes(i == 1 ? bytes_of_second : i + 2, std::byte(i));
      datagrams.add(bytes);
    }
    return receivers.send(datagrams, now_ns);
  };
  SendOutcome outcome = pass(3, 0);
  CHECK(outcome.sent + outcome.failed == 80);
  CHECK(outcome.sent >= 40);
  auto datagrams = receiver.received(40);
  std::uint64_t turns = 1;
  for (; outcome.sent > 40 && turns < 100; ++turns) {  // a busy kernel refuses a little later
    outcome = pass(3, 0);
    const auto more = receiver.received(40 * (turns + 1));
    datagrams.insert(datagrams.end(), more.begin(), more.end());
  }
  CHECK(outcome.sent == 40);
  CHECK(outcome.failed == 40);
  REQUIRE(datagrams.size() == 40 * turns);
  for (std::size_t i = 0; i < datagrams.size(); ++i) {
    CHECK(datagrams[i] == std::vector(i % 40 + 2, std::byte(i % 40)));
  }
  REQUIRE(receivers.drain_news(0).size() == 1);  // of the dead one
  // One that is too large does not go, and those behind it fail until the socket is tried again.
  outcome = pass(70'000, kNanosPerSecond);
  CHECK(outcome.sent + outcome.failed == 80);
  CHECK(outcome.failed >= 39);
  CHECK(receiver.received(40 * turns + 1).size() == 1);
  const auto news = receivers.drain_news(kNanosPerSecond);
  REQUIRE(news.size() == 1);
  CHECK(news[0].text.starts_with("sending to " + receiver.endpoint() + " fails: so many people"));
  static_cast<void>(pass(3, 3 * kNanosPerSecond));
  CHECK(receiver.received(40 * turns + 41).size() == 40);
}

TEST_CASE("what the network loses on this side, and for want of a machine, counts as lost") {
  if (std::system("unshare --user --map-root-user --net tc qdisc add dev lo root tbf rate 1mbit "
                  "burst 2kb limit 8kb 2>/dev/null") != 0) {
    WARN("SKIPPED: no network namespaces with slow interfaces here");
    return;
  }
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  CHECK(std::system(("unshare --user --map-root-user --net '" + self +
                     "' 'on a slow network: what is lost is counted' >&2")
                        .c_str()) == 0);
}

TEST_CASE("on a slow network: what is lost is counted", "[.]") {
  REQUIRE(std::system("ip link set lo up && tc qdisc add dev lo root tbf rate 1mbit burst 2kb "
                      "limit 8kb && ip link add a0 type veth peer name b0 && "
                      "ip address add 10.9.8.1/24 dev a0 && ip link set a0 up && "
                      "ip link set b0 up && ip ntable change name arp_cache dev a0 retrans 10") ==
          0);
  const auto pass = [](UdpReceivers& receivers) {
    Datagrams datagrams;
    for (int i = 0; i < 40; ++i) datagrams.add(std::vector<std::byte>(1000, std::byte{}));
    return receivers.send(datagrams, 0);
  };
  UdpReceiver receiver;
  auto near = UdpReceivers::open({receiver.endpoint()}).value();
  const SendOutcome slow = pass(near);
  CHECK(slow.sent + slow.dropped == 40);
  CHECK(slow.dropped > 0);
  CHECK(receiver.received(slow.sent).size() == slow.sent);
  REQUIRE(near.drain_news(0).size() == 1);

  auto far = UdpReceivers::open({"10.9.8.77:9763"}).value();  // no machine has this address
  std::uint64_t failed = 0;
  for (int i = 0; i < 500 && failed < 40; ++i) {
    const SendOutcome outcome = pass(far);
    CHECK(outcome.sent + outcome.failed == 40);
    failed += outcome.failed;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(failed >= 40);
  const auto news = far.drain_news(0);
  REQUIRE(news.size() == 1);
  CHECK(news[0].text == "sending to 10.9.8.77:9763 fails: No route to host");
}

TEST_CASE("a stream without a person is named, and the others are sent") {
  UdpReceiver receiver;
  Protocol protocol{.kind = OutputKind::kMvn, .people = {"values", "ann"}};
  OutputRig rig(protocol_config(protocol, receiver));
  const auto walk = motion::make_walker({.seconds = 1.0}).value();
  rig.output->stream_comes(info_of(4, "values", nullptr));
  rig.output->stream_comes(info_of(5, "ann", walk.skeleton));
  rig.pass(frame_of(5, walk.frame(0)), 0);
  REQUIRE(rig.reported.size() == 1);
  CHECK(rig.reported[0] == "4: output test: stream 'values' cannot be sent: it has no pose");
  CHECK(receiver.received(1).size() == 3);  // name, T-pose, pose
}

}  // namespace posed::output
