// MVN over TCP, the options, the descriptions that the decoder writes, and the golden log.
#include <algorithm>
#include <array>
#include <fstream>
#include <random>

#include "drivers/driver.hpp"
#include "tests/support/allocations.hpp"
#include "tests/unit/drivers/mvn_rig.hpp"
#include "tests/unit/drivers/recorded_log.hpp"
#include "tests/unit/drivers/refused.hpp"

namespace posed::drivers::mvn {
namespace {

using test::MvnBytes;
using test::MvnSession;

// The bytes of half a second of two characters with all that MVN sends, as over TCP.
MvnBytes tcp_stream() {
  auto emulator = test::mvn_emulator(
      {Type::kEuler, Type::kQuaternion, Type::kMeta, Type::kScale, Type::kLinear, Type::kTimeCode},
      2, 1472);
  MvnBytes all;
  while (emulator.next_due_ns() < kNanosPerSecond / 2) emulator.emit(emulator.next_due_ns(), all);
  return all;
}

// A decoder of a TCP stream that knows both characters from the start.
struct TcpSession : MvnSession {
  TcpSession() : MvnSession(true) {
    auto emulator = test::mvn_emulator({Type::kQuaternion, Type::kMeta, Type::kScale}, 2);
    MvnSession other;
    other.run(emulator, kNanosPerSecond);
    layouts = std::move(other.layouts);
    decoder.use(*layouts.back());
  }
  void feed_raw(std::span<const std::byte> bytes) { decoder.feed(bytes, 0, sink); }
};

void check_equal(const test::CollectSink& a, const test::CollectSink& b) {
  CHECK(a.outcomes == b.outcomes);
  CHECK(a.bodies == b.bodies);
  CHECK(a.descriptions == b.descriptions);
  CHECK(a.described == b.described);
  REQUIRE(a.frames.size() == b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    CHECK(test::same_pose(a.frames[i], b.frames[i]));
    CHECK(a.frames[i].header.device_ns == b.frames[i].header.device_ns);
  }
}

Character named(std::uint8_t id) {
  Character character = emulated_waver();
  character.id = id;
  return character;
}

MvnBytes description(std::span<const Character> characters) {
  MvnBytes bytes(kMaxMvnDescription);
  std::size_t used = write_description_head(characters.size(), bytes);
  for (const Character& character : characters) {
    used += write_character(character, std::span(bytes).subspan(used));
  }
  bytes.resize(used);
  return bytes;
}

}  // namespace

TEST_CASE("mvn: a TCP stream may be cut anywhere") {
  const MvnBytes bytes = tcp_stream();
  TcpSession whole;
  whole.feed_raw(bytes);
  CHECK(whole.sink.frames.size() == 100);
  CHECK(whole.damaged() == 0);
  std::mt19937 random(11);
  for (const std::size_t longest : {1U, 5U, 24U, 100U, 1000U, 70'000U}) {
    TcpSession cut;
    std::span<const std::byte> rest = bytes;
    while (!rest.empty()) {
      const std::size_t piece = std::min(rest.size(), 1 + random() % longest);
      cut.feed_raw(rest.first(piece));
      rest = rest.subspan(piece);
    }
    check_equal(cut.sink, whole.sink);
  }
}

TEST_CASE("mvn: a TCP stream goes on at the next head after damage") {
  const MvnBytes bytes = tcp_stream();
  std::mt19937 random(13);
  for (int round = 0; round < 200; ++round) {
    MvnBytes bad = bytes;
    const std::size_t at = random() % (bad.size() / 2);
    const auto place = bad.begin() + static_cast<std::ptrdiff_t>(at);
    switch (round % 3) {
      case 0:
        bad.erase(place, place + static_cast<std::ptrdiff_t>(1 + random() % 3000));
        break;
      case 1:
        bad.insert(place, 1 + random() % 3000, static_cast<std::byte>(random()));
        break;
      default:
        bad[at] ^= static_cast<std::byte>(1 + random() % 255);
    }
    TcpSession session;
    session.feed_raw(bad);
    // 3000 bytes are gone, and those of the datagrams beside them.
    CHECK(session.sink.frames.size() >= 80);
    for (const Frame& frame : session.sink.frames) CHECK(test::is_valid(frame));
  }
  TcpSession garbage;
  garbage.feed_raw(MvnBytes(200'000, std::byte{'M'}));
  CHECK(garbage.sink.count(Outcome::kForeign) == 1);
  garbage.feed_raw(bytes);
  CHECK(garbage.sink.frames.size() == 100);
}

TEST_CASE("mvn: headers without a length are not for TCP") {
  MvnBytes old = test::mvn_datagram(Type::kQuaternion, 2);
  std::fill(old.begin() + 17, old.begin() + 24, std::byte{});
  TcpSession session;
  session.feed_raw(old);
  CHECK(session.sink.count(Outcome::kForeign) == 1);
  CHECK(session.sink.frames.empty());
}

TEST_CASE("mvn: a description is refused when anything in it is wrong") {
  Character gloved = emulated_walker();
  gloved.values.set(static_cast<std::size_t>(ValueGroup::kCentreOfMass));
  const std::array<Character, 2> both{gloved, named(200)};
  const MvnBytes good = description(both);
  const auto layout = make_layout(good);
  REQUIRE(layout);
  REQUIRE((*layout)->bodies.size() == 2);
  CHECK((*layout)->bodies[0].skeleton->joints.size() == kSegments);
  CHECK((*layout)->bodies[0].samples.names.size() == 3);
  CHECK((*layout)->bodies[1].skeleton->joints.size() == kBodySegments);
  CHECK((*layout)->bodies[1].samples.names.empty());
  CHECK(make_layout(description({})).value()->bodies.empty());
  for (std::size_t size = 0; size < good.size(); ++size) {
    const auto cut = make_layout(std::span(good).first(size));
    REQUIRE_FALSE(cut);
    CHECK(cut.error().message.find('\n') == std::string::npos);
  }
  const auto refused = [](MvnBytes bytes, std::size_t at, unsigned value) {
    bytes.at(at) = static_cast<std::byte>(value);
    return !make_layout(bytes);
  };
  CHECK(refused(good, 0, 2));      // version
  CHECK(refused(good, 1, 33));     // characters
  CHECK(refused(good, 3, 0x80));   // flags
  CHECK(refused(good, 4, 61));     // the name's size
  CHECK(refused(good, 14, 0x7F));  // an offset: NaN or too long
  MvnBytes longer = good;
  longer.push_back({});
  CHECK_FALSE(make_layout(longer));
  CHECK_FALSE(make_layout(description(std::array{named(3), named(3)})));
  std::mt19937 random(7);
  for (int round = 0; round < 500; ++round) {
    MvnBytes bad = good;
    for (int i = 0; i <= round % 4; ++i) {
      bad[random() % bad.size()] = static_cast<std::byte>(random());
    }
    const auto any = make_layout(bad);
    if (!any) CHECK_FALSE(any.error().message.empty());
  }
}

TEST_CASE("mvn: learning and describing characters does not allocate") {
  auto emulator =
      test::mvn_emulator({Type::kQuaternion, Type::kCentreOfMass, Type::kJointAngles, Type::kLinear,
                          Type::kAngular, Type::kTrackers, Type::kMeta, Type::kScale},
                         2, 700);
  std::vector<std::pair<std::int64_t, MvnBytes>> datagrams;
  while (emulator.next_due_ns() < kNanosPerSecond) {
    const std::int64_t due_ns = emulator.next_due_ns();
    emulator.emit(due_ns, datagrams.emplace_back(due_ns, MvnBytes()).second);
  }
  MvnDecoder decoder(false);
  test::CollectSink sink;
  const std::uint64_t before = test::allocations();
  for (const auto& [at_ns, bytes] : datagrams) decoder.feed(bytes, at_ns, sink);
  CHECK(test::allocations() == before);
  CHECK(sink.descriptions > 0);
}

TEST_CASE("mvn: wrong options are refused at once") {
  const Driver& driver = *find_driver("mvn");
  test::check_refused(driver,
                      {{{{"listen", std::string("nonsense")}}, "an address and a port"},
                       {{{"link", std::string("pigeon")}}, "link"},
                       {{{"connect", std::string("127.0.0.1:9763")}}, "connect is for link"},
                       {{{"rate_hz", 0.0}}, "rate_hz"},
                       {{{"types", std::string("02 03")}}, "types"},
                       {{{"types", std::string("two")}}, "types"},
                       {{{"types", std::string("12 13")}}, "01, 02 or 05"},
                       {{{"characters", std::int64_t{3}}}, "characters"},
                       {{{"datagram_bytes", std::int64_t{50}}}, "datagram_bytes"}});
  const auto udp = driver.expect({}).value();
  CHECK(udp.text == "mvn link=udp rate=60");
  CHECK(udp.identity == "udp 127.0.0.1:9763");
  const auto tcp = driver.expect({{"link", std::string("tcp")}, {"rate_hz", 240.0}}).value();
  CHECK(tcp.text == "mvn link=tcp rate=240");
  test::check_undescribed(driver, {"", "mvn", "mvn link=udp rate=", "mvn link=usb rate=60",
                                   "mvn link=tcp rate=nan", "mvn link=udp rate=0"});
}

namespace {

// The row of a datagram, and that of the description that it brought about.
std::string recorded_row_of(MvnSession& session, const MvnBytes& bytes) {
  const int before = session.sink.descriptions;
  session.feed(bytes);
  std::string text = test::recorded_row(session.now_ns, "hex", bytes);
  if (session.sink.descriptions != before) {
    text += test::recorded_row(session.now_ns, "bodies", session.sink.described);
  }
  return text;
}

// Joint angles, kinematics and trackers of the first character, once before they are described and
// once after.
std::string mvn_values_log(MvnSession& session) {
  std::string text;
  for (const std::uint32_t sample : {50U, 51U}) {
    session.now_ns += 400'000'000;
    for (const Type type : {Type::kJointAngles, Type::kLinear, Type::kAngular, Type::kTrackers}) {
      const MvnBytes payload = encode_values(type, test::mvn_pose(false));
      Head head = test::mvn_head(type, sample, true);
      head.items = static_cast<std::uint8_t>(payload.size() / item_bytes(type));
      head.time_ms = sample * 100;
      text += recorded_row_of(session, encode_datagram(head, payload));
    }
  }
  return text;
}

// Two characters; the first one has gloves, so its samples are split. A bit of the second one's
// pose flips, another one is cut, one comes twice, and a part of the first one's sample is lost.
std::string mvn_log() {
  std::string text =
      "# Not a recording: made by posed's emulator of Xsens MVN, with damage put in.\n"
      "driver mvn\nidentity udp 127.0.0.1:9763\ntext mvn link=udp rate=10\n";
  MvnEmulator emulator(
      {.rate_hz = 10.0,
       .types = {Type::kQuaternion, Type::kMeta, Type::kScale, Type::kCentreOfMass},
       .characters = 2,
       .longest = 1472});
  MvnSession session;
  for (int i = 0; i < 44; ++i) {
    const std::int64_t at_ns = emulator.next_due_ns();
    MvnBytes bytes;
    emulator.emit(at_ns, bytes);
    if (i == 27) bytes.at(kHeadBytes + 17) ^= std::byte{0x40};
    if (i == 32) bytes.resize(bytes.size() / 2);
    if (i == 35) continue;
    for (int twice = 0; twice < (i == 37 ? 2 : 1); ++twice) {
      session.now_ns = at_ns;
      text += recorded_row_of(session, bytes);
    }
  }
  return text + mvn_values_log(session);
}

}  // namespace

TEST_CASE("mvn: write the log of the emulated system", "[.write-logs]") {
  const auto path = test::golden("devices") / "mvn.log";
  if (!std::filesystem::exists(path)) std::ofstream(path) << mvn_log();
}

}  // namespace posed::drivers::mvn
