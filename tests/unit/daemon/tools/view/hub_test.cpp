#include "daemon/tools/view/hub.hpp"
#include "daemon/tools/view/hand_feed.hpp"

#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "proto/frame/time.hpp"

namespace posed::view {
namespace {

using nlohmann::json;

std::string numbered(std::uint32_t number, const v1::ControlRequest& request) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(number >> (8 * i) & 0xff);
  return bytes + request.SerializeAsString();
}

v1::ControlRequest set_alpha() {
  v1::ControlRequest request;
  request.mutable_set_parameter()->set_stream("walker");
  request.mutable_set_parameter()->set_name("alpha");
  request.mutable_set_parameter()->set_number(0.5);
  return request;
}

v1::ControlRequest model_piece(std::uint64_t offset) {
  v1::ControlRequest request;
  request.mutable_model_part()->set_total(200);
  request.mutable_model_part()->set_offset(offset);
  request.mutable_model_part()->set_bytes(std::string(100, 'm'));
  return request;
}

// A hub whose daemon is the test.
struct HubRig {
  HubRig() {
    hub.control_is({.may = true, .reason = ""});
    hub.daemon_is({.alive = true});
  }
  ~HubRig() {
    for (Tab* tab : joined) hub.leave(*tab);
  }
  void join(Tab& tab) {
    tab.wake = [this] { ++wakes; };
    hub.join(tab);
    joined.push_back(&tab);
  }
  void send(Tab& tab, std::uint32_t number, const v1::ControlRequest& request) {
    hub.handle(tab, numbered(number, request), false, now_ns);
  }

  std::vector<std::pair<std::uint64_t, std::string>> asked;
  std::vector<std::string> fed;  // hands of a camera
  std::string fed_to;
  bool reachable = true;
  int wakes = 0;
  std::int64_t now_ns = 0;
  std::vector<Tab*> joined;
  Hub hub{{.version = "0.1", .connect = "tcp://127.0.0.1:5570", .same_machine = true},
          [this](std::uint64_t ticket, std::string_view request) {
            if (reachable) asked.emplace_back(ticket, request);
            return reachable;
          },
          [this](std::string_view source, std::string_view landmarks) {
            fed_to = source;
            fed.emplace_back(landmarks);
            return std::string();
          }};
};

struct Got {
  std::string topic;  // "" of a word
  std::string body;
};

Got got_of(const Parcel& parcel) {
  if (parcel.text) return {"", *parcel.bytes};
  const auto length = static_cast<unsigned char>(parcel.bytes->front());
  return {parcel.bytes->substr(1, length), parcel.bytes->substr(1 + length)};
}

std::vector<Got> all_of(Tab& tab) {
  std::vector<Got> all;
  while (const auto parcel = tab.outbox.next()) all.push_back(got_of(*parcel));
  return all;
}

v1::ControlReply reply_of(const Got& got) {
  v1::ControlReply reply;
  REQUIRE(reply.ParseFromString(got.body));
  return reply;
}

TEST_CASE("what a hostile daemon sends is kept up to a limit, and let go with its streams") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  const std::string large(link::kMaxStreamMessage, 'x');
  for (int i = 0; i < 2000; ++i) {
    const std::string name = std::to_string(i);
    rig.hub.receive("skeleton/" + name, large, 0);
    rig.hub.receive("pose/" + name, large, 0);
    rig.hub.receive("pose/" + name, large + "x", 0);
  }
  CHECK(rig.hub.kept_bytes() > kMaxKeptBytes / 2);
  CHECK(rig.hub.kept_bytes() <= kMaxKeptBytes + 1000);
  CHECK(rig.hub.counts().foreign > 2000);
  rig.hub.daemon_is({.alive = false});
  CHECK(rig.hub.kept_bytes() == 0);
  rig.hub.receive("skeleton/walker", "S", 0);
  CHECK(rig.hub.kept_bytes() > 0);
}

TEST_CASE("large streams and events of a hostile source hide nobody's") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  rig.hub.handle(tab, R"({"type":"ready"})", true, 0);
  static_cast<void>(all_of(tab));
  const std::string large(link::kMaxStreamMessage, 'x'), usual(8000, 'u');
  const auto attack = [&](int from) {
    for (int i = from; i < from + 1024; ++i) {
      const std::string name = std::to_string(i);
      for (const char* kind : {"skeleton/", "pose/", "sensor/"}) {
        rig.hub.receive(kind + name, large, 0);
      }
    }
    // Events wait until they are sent, so they cannot be let go of.
    const std::string event(kMaxEventBytes, 'e');
    for (std::size_t i = 0; i < kMaxEvents; ++i) rig.hub.receive("event/0", event, 0);
  };
  attack(0);
  for (int round = 0; round < 3; ++round) {
    rig.hub.receive("skeleton/ann", usual, 0);
    rig.hub.receive("pose/ann", usual, 0);
    attack(0);
  }
  CHECK(rig.hub.kept_bytes() <= kMaxKeptBytes);
  const auto got = all_of(tab);
  CHECK(std::ranges::count(got, "skeleton/ann", &Got::topic) == 1);
  CHECK(std::ranges::count(got, "pose/ann", &Got::topic) == 1);
}

TEST_CASE("names that come and go leave a place for those that stay") {
  HubRig rig;
  for (std::int64_t second = 0; second < 12; ++second) {
    for (int i = 0; i < 1024; ++i) {
      rig.hub.receive("pose/" + std::to_string(1024 * second + i), "P", second * kNanosPerSecond);
    }
  }
  CHECK(rig.hub.counts().foreign == 0);
  rig.hub.receive("skeleton/ann", "S", 12 * kNanosPerSecond);
  Tab tab;
  rig.join(tab);
  CHECK(all_of(tab).back().topic == "skeleton/ann");
}

TEST_CASE("a new tab is greeted and gets the skeletons and the last stats at once") {
  HubRig rig;
  rig.hub.receive("skeleton/walker", "S", 0);
  rig.hub.receive("pose/walker", "P", 0);
  rig.hub.receive("stats", "old", 0);
  rig.hub.receive("stats", "new", 0);
  Tab tab;
  rig.join(tab);
  const auto first = all_of(tab);
  REQUIRE(first.size() == 4);
  const json hello = json::parse(first[0].body);
  CHECK(hello.at("type") == "hello");
  CHECK(hello.at("may_control") == true);
  CHECK(hello.at("connect") == "tcp://127.0.0.1:5570");
  CHECK(json::parse(first[1].body).at("alive") == true);
  CHECK(first[2].topic == "skeleton/walker");
  CHECK(first[2].body == "S");
  CHECK(first[3].body == "new");
}

TEST_CASE("a skeleton is passed on when it changes, a pose with each credit, an event at once") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  static_cast<void>(all_of(tab));
  for (int i = 0; i < 3; ++i) rig.hub.receive("skeleton/a", "S", 0);
  rig.hub.receive("skeleton/a", "T", 0);
  rig.hub.receive("pose/a", "P", 0);
  rig.hub.receive("event/a", "E", 0);
  rig.hub.receive("nonsense", "N", 0);
  rig.hub.receive("pose", "N", 0);
  rig.hub.receive("pose/" + std::string(200, 'x'), "N", 0);
  rig.hub.flush();
  CHECK(rig.hub.counts().foreign == 3);
  auto got = all_of(tab);
  REQUIRE(got.size() == 2);
  CHECK(got[0].topic == "event/a");
  CHECK(got[1].body == "T");
  rig.hub.receive("skeleton/a", "T", 0);  // the daemon repeats it every second
  rig.hub.handle(tab, R"({"type":"ready"})", true, 0);
  got = all_of(tab);
  REQUIRE(got.size() == 1);
  CHECK(got[0].topic == "pose/a");
}

// A message of a camera's hands; `members` replaces the time.
std::string hands_word(const std::string& members = R"("time_ns":1000000)", int numbers = 63) {
  std::string text = R"({"posed":"landmarks","version":1,)" + members +
                     R"(,"more":"than posed knows","hands":[{"side":"left","points":[)";
  for (int i = 0; i < numbers; ++i) text += (i == 0 ? "" : ",") + std::to_string(0.003 * i);
  return text + "]}]}";
}

TEST_CASE(
    "a camera's hands pass if they are sound, with the right to control, at a camera's rate") {
  HubRig rig;
  Tab tab;
  Tab other;
  rig.join(tab);
  rig.join(other);
  const auto feed = [&](Tab& from, const std::string& text, std::int64_t now_ns) {
    rig.hub.handle(from, text, true, now_ns);
  };
  feed(tab, hands_word(), 0);
  REQUIRE(rig.fed.size() == 1);
  CHECK(rig.fed[0].find("more") == std::string::npos);  // written anew
  CHECK(rig.fed[0].find(R"("time_ns":1000000)") != std::string::npos);
  feed(other, hands_word(), 1000);  // while the first page's camera runs
  feed(tab, hands_word(R"("time_ns":NaN)"), 0);
  feed(tab, hands_word(R"("time_ns":1e300)"), 0);
  feed(tab, hands_word(R"("version":2,"time_ns":1)"), 0);
  feed(tab, hands_word(R"("time_ns":1)", 30'000), 0);  // 10,000 points
  feed(tab, hands_word(R"("time_ns":1)", 62), 0);
  feed(tab, R"({"posed":"landmarks",)", 0);
  CHECK(rig.fed.size() == 1);
  static_cast<void>(all_of(tab));
  for (int i = 0; i < 1000; ++i) feed(tab, hands_word(), 2 * kNanosPerSecond + i * 1'000'000);
  CHECK(rig.fed.size() <= 1 + kMaxLandmarks_hz);
  CHECK(rig.hub.counts().refused_landmarks == 7 + 1000 - kMaxLandmarks_hz);
  CHECK(all_of(tab).size() == 1);  // it is told once
  rig.hub.control_is({.may = false, .reason = "only looking"});
  static_cast<void>(all_of(tab));
  rig.fed.clear();
  feed(tab, hands_word(), 9 * kNanosPerSecond);
  CHECK(rig.fed.empty());
  CHECK(json::parse(all_of(tab).at(0).body).at("refusal") == "only looking");
}

TEST_CASE("hands go where the daemon listens, and a page that leaves or is silent ends them") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  const auto feed = [&] { rig.hub.handle(tab, hands_word(), true, rig.now_ns); };
  feed();
  CHECK(rig.fed_to.empty());  // the daemon has told of no source
  v1::Stats stats;
  stats.add_source()->set_driver("natnet");
  auto& source = *stats.add_source();
  source.set_driver("landmarks");
  source.set_identity("udp 127.0.0.1:7421");
  rig.hub.receive("stats", stats.SerializeAsString(), 0);
  feed();
  CHECK(rig.fed_to == "udp 127.0.0.1:7421");
  rig.hub.expire(kNanosPerSecond);
  REQUIRE(rig.fed.size() == 2);
  rig.hub.expire(3 * kNanosPerSecond);
  REQUIRE(rig.fed.size() == 3);
  CHECK(rig.fed.back().find(R"("end":true)") != std::string::npos);
  rig.hub.expire(9 * kNanosPerSecond);
  feed();
  REQUIRE(rig.fed.size() == 4);
  rig.hub.leave(tab);
  CHECK(rig.fed.size() == 5);
}

TEST_CASE("a page's hands reach a source on this machine, or it is told that nobody gets them") {
  HandFeed feed;
  CHECK(feed.send("", "{}").find("no source") != std::string::npos);
  for (const char* elsewhere : {"tcp 127.0.0.1:7420", "udp 192.0.2.1:7420", "udp nonsense"}) {
    CHECK(feed.send(elsewhere, "{}").find("nobody gets the hands") != std::string::npos);
  }
}

TEST_CASE("a request gets its own reply, whatever the order") {
  HubRig rig;
  Tab one;
  Tab two;
  rig.join(one);
  rig.join(two);
  static_cast<void>(all_of(one));
  static_cast<void>(all_of(two));
  rig.send(one, 7, set_alpha());
  rig.send(two, 7, set_alpha());
  REQUIRE(rig.asked.size() == 2);
  CHECK(rig.asked[0].second == set_alpha().SerializeAsString());
  rig.hub.replied(rig.asked[1].first, "to two");
  rig.hub.replied(rig.asked[0].first, "to one");
  rig.hub.replied(rig.asked[0].first, "twice");
  rig.hub.replied(999, "to nobody");
  const auto to_one = all_of(one);
  const auto to_two = all_of(two);
  REQUIRE(to_one.size() == 1);
  REQUIRE(to_two.size() == 1);
  CHECK(to_one[0].topic == "reply/7");
  CHECK(to_one[0].body == "to one");
  CHECK(to_two[0].body == "to two");
}

TEST_CASE("a page reaches the daemon's folders of models and recordings") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  v1::ControlRequest request;
  request.mutable_list_recordings();
  rig.send(tab, 1, request);
  request.mutable_fetch_recording()->set_name("a.bvh");
  rig.send(tab, 2, request);
  request.mutable_rename_model()->set_name("a.style");
  rig.send(tab, 3, request);
  request.mutable_delete_model()->set_name("a.style");
  rig.send(tab, 4, request);
  CHECK(rig.asked.size() == 4);
}

TEST_CASE("requests that a page may not make are refused in a reply") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  static_cast<void>(all_of(tab));
  v1::ControlRequest stop;
  stop.mutable_stop();
  v1::ControlRequest haptics;
  haptics.mutable_haptics();
  rig.send(tab, 1, stop);
  rig.send(tab, 2, haptics);
  rig.send(tab, 3, {});
  rig.hub.handle(tab, std::string("\4\0\0\0\xff\xff", 6), false, 0);
  rig.hub.handle(tab, "123", false, 0);  // has no number to answer to
  CHECK(rig.asked.empty());
  const auto got = all_of(tab);
  REQUIRE(got.size() == 4);
  CHECK(got[0].topic == "reply/1");
  CHECK(reply_of(got[0]).error() == "a page may not end the daemon: use `posed ctl stop`");
  for (const Got& one : got) CHECK_FALSE(reply_of(one).ok());
  // What a newer daemon might take for something else does not pass, either.
  std::string sly = set_alpha().SerializeAsString();
  sly += std::string("\xa2\x06\x00", 3);  // field 100
  rig.hub.handle(tab, std::string("\5\0\0\0", 4) + sly, false, 0);
  REQUIRE(rig.asked.size() == 1);
  CHECK(rig.asked[0].second == set_alpha().SerializeAsString());
}

TEST_CASE("a page that may not control is told why, also for each request") {
  HubRig rig;
  rig.hub.control_is({.may = false, .reason = "no right"});
  Tab tab;
  rig.join(tab);
  const json hello = json::parse(all_of(tab).at(0).body);
  CHECK(hello.at("may_control") == false);
  CHECK(hello.at("read_only_reason") == "no right");
  rig.send(tab, 1, set_alpha());
  CHECK(rig.asked.empty());
  CHECK(reply_of(all_of(tab).at(0)).error() == "no right");
  rig.hub.control_is({.may = true, .reason = ""});
  rig.hub.control_is({.may = true, .reason = ""});
  const auto got = all_of(tab);
  REQUIRE(got.size() == 1);
  CHECK(json::parse(got[0].body).at("type") == "control");
}

TEST_CASE("a request that cannot be sent, or gets no answer, is told") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  static_cast<void>(all_of(tab));
  rig.reachable = false;
  rig.send(tab, 1, set_alpha());
  CHECK(reply_of(all_of(tab).at(0)).error().contains("cannot be reached"));
  rig.reachable = true;
  rig.send(tab, 2, set_alpha());
  rig.hub.expire(kNanosPerSecond);
  CHECK(all_of(tab).empty());
  rig.hub.expire(6 * kNanosPerSecond);
  const json word = json::parse(all_of(tab).at(0).body);
  CHECK(word.at("type") == "no_reply");
  CHECK(word.at("request") == 2);
  rig.hub.replied(rig.asked.back().first, "late");
  CHECK(all_of(tab).empty());
  CHECK(tab.under_way == 0);
}

TEST_CASE("a page has few requests under way, and one page sends a model at a time") {
  HubRig rig;
  Tab one;
  Tab two;
  rig.join(one);
  rig.join(two);
  for (std::uint32_t i = 0; i < 2 * kMaxUnderWay; ++i) rig.send(one, i, set_alpha());
  CHECK(rig.asked.size() == kMaxUnderWay);
  rig.send(two, 1, model_piece(0));
  CHECK(rig.asked.size() == kMaxUnderWay + 1);
  Tab three;
  rig.join(three);
  rig.send(three, 1, model_piece(0));
  CHECK(rig.asked.size() == kMaxUnderWay + 1);
  rig.send(two, 2, model_piece(100));  // the last piece
  rig.send(three, 2, model_piece(0));
  CHECK(rig.asked.size() == kMaxUnderWay + 3);
}

TEST_CASE("a tab that leaves gets nothing more, and its replies are dropped") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  rig.send(tab, 1, set_alpha());
  static_cast<void>(all_of(tab));
  rig.hub.leave(tab);
  rig.joined.clear();
  rig.hub.receive("event/a", "E", 0);
  rig.hub.replied(rig.asked[0].first, "R");
  rig.hub.expire(10 * kNanosPerSecond);
  CHECK(all_of(tab).empty());
  CHECK(rig.hub.tabs() == 0);
}

TEST_CASE("a tab that has left is not heard any more") {
  HubRig rig;
  {
    Tab tab;
    rig.join(tab);
    rig.joined.clear();
    rig.hub.leave(tab);
    rig.send(tab, 1, set_alpha());
    rig.send(tab, 2, model_piece(0));
    CHECK(tab.under_way == 0);
  }
  CHECK(rig.asked.empty());
  rig.hub.replied(1, "for nobody");
  Tab other;
  rig.join(other);
  rig.send(other, 1, model_piece(0));
  CHECK(rig.asked.size() == 1);
}

TEST_CASE("a body that comes back after seconds has its skeleton sent again") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  rig.hub.receive("skeleton/a", "S", 0);
  static_cast<void>(all_of(tab));
  rig.hub.receive("skeleton/a", "S", kNanosPerSecond);  // the daemon repeats it
  CHECK(all_of(tab).empty());
  rig.hub.receive("skeleton/a", "S", 5 * kNanosPerSecond);
  CHECK(all_of(tab).size() == 1);
}

TEST_CASE("a daemon that goes takes its poses and skeletons with it") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  rig.hub.receive("skeleton/a", "S", 0);
  rig.hub.receive("pose/a", "P", 0);
  static_cast<void>(all_of(tab));
  rig.hub.daemon_is({.alive = false, .sentence = "gone"});
  rig.hub.handle(tab, R"({"type":"ready"})", true, 0);
  auto got = all_of(tab);
  REQUIRE(got.size() == 1);
  CHECK(json::parse(got[0].body).at("sentence") == "gone");
  rig.hub.daemon_is({.alive = true});
  rig.hub.receive("skeleton/a", "S", 0);  // the same, but a page may have forgotten it
  got = all_of(tab);
  REQUIRE(got.size() == 2);
  CHECK(got[1].topic == "skeleton/a");
}

TEST_CASE("streams are bounded, and forgotten when they are silent") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  rig.hub.handle(tab, R"({"type":"ready"})", true, 0);
  static_cast<void>(all_of(tab));
  for (std::size_t i = 0; i < 2 * kMaxViewStreams; ++i) {
    rig.hub.receive("pose/" + std::to_string(i), "P", 0);
  }
  CHECK(rig.hub.counts().foreign == kMaxViewStreams);
  CHECK(all_of(tab).size() == kMaxViewStreams);
  rig.hub.expire(11 * kNanosPerSecond);
  rig.hub.receive("pose/new", "P", 11 * kNanosPerSecond);
  CHECK(rig.hub.counts().foreign == kMaxViewStreams);
}

TEST_CASE("the clock is answered, and words that are none are ignored") {
  HubRig rig;
  Tab tab;
  rig.join(tab);
  static_cast<void>(all_of(tab));
  rig.hub.handle(tab, R"({"type":"clock","t0":1234.5})", true, 9'007'199'254'740'993);
  const json clock = json::parse(all_of(tab).at(0).body);
  CHECK(clock.at("t0") == 1234.5);
  CHECK(clock.at("monotonic_ns") == "9007199254740993");
  for (const char* word : {"", "{", "[]", "null", "{}", R"({"type":3})", R"({"type":"clock"})",
                           R"({"type":"clock","t0":"1"})", R"({"type":"other"})", "\xff\xfe"}) {
    rig.hub.handle(tab, word, true, 0);
  }
  rig.hub.handle(tab, R"({"type":"clock","t0":1,"x":")" + std::string(2000, 'x') + "\"}", true, 0);
  CHECK(all_of(tab).empty());
}

}  // namespace
}  // namespace posed::view
