#include "daemon/tools/view/outbox.hpp"

#include <catch2/catch.hpp>

#include <string>
#include <vector>

namespace posed::view {
namespace {

Bytes of(const std::string& text) { return std::make_shared<const std::string>(text); }

// Everything that may be sent now.
std::vector<std::string> taken(Outbox& outbox) {
  std::vector<std::string> all;
  while (const auto parcel = outbox.next()) all.push_back(*parcel->bytes);
  return all;
}

using Texts = std::vector<std::string>;

TEST_CASE("a pose waits for the page's credit, and the newest wins") {
  Outbox outbox;
  outbox.put_thinned("pose/a", of("a1"));
  CHECK(taken(outbox).empty());
  outbox.put_thinned("pose/a", of("a2"));
  outbox.put_thinned("pose/b", of("b1"));
  outbox.ready();
  CHECK(taken(outbox) == Texts{"a2", "b1"});
  outbox.put_thinned("pose/a", of("a3"));
  CHECK(taken(outbox).empty());  // the credit is spent
  CHECK(outbox.counts().replaced == 1);
}

TEST_CASE("a credit waits for the next pose of each stream, and credits do not add up") {
  Outbox outbox;
  outbox.ready();
  outbox.ready();
  outbox.ready();
  outbox.put_thinned("pose/a", of("a1"));
  CHECK(taken(outbox) == Texts{"a1"});
  outbox.put_thinned("pose/a", of("a2"));
  CHECK(taken(outbox).empty());
  outbox.put_thinned("pose/b", of("b1"));  // of another stream
  CHECK(taken(outbox) == Texts{"b1"});
}

TEST_CASE("skeletons come before poses and need no credit; only the newest is kept") {
  Outbox outbox;
  outbox.ready();
  outbox.put_thinned("pose/a", of("pose"));
  outbox.put_newest("skeleton/a", of("old"));
  outbox.put_newest("skeleton/a", of("new"));
  outbox.put_event(of("event"));
  outbox.put_answer({.bytes = of("answer"), .text = true});
  CHECK(taken(outbox) == Texts{"answer", "event", "new", "pose"});
}

TEST_CASE("a page that does not read costs a fixed amount") {
  Outbox outbox;
  outbox.ready();
  for (int i = 0; i < 10'000; ++i) {
    outbox.put_event(of("e" + std::to_string(i)));
    outbox.put_answer({.bytes = of("r" + std::to_string(i))});
    outbox.put_newest("stats", of("s" + std::to_string(i)));
    outbox.put_thinned("pose/a", of("p" + std::to_string(i)));
  }
  CHECK_FALSE(outbox.has_room());
  const Texts left = taken(outbox);
  CHECK(left.size() == kMaxAnswers + kMaxEvents + 2);
  CHECK(left.back() == "p9999");
  CHECK(left[kMaxAnswers + kMaxEvents - 1] == "e9999");
  CHECK(outbox.has_room());
  CHECK(outbox.counts().dropped == 2 * 10'000 - kMaxAnswers - kMaxEvents);
}

TEST_CASE("a page that is slower than the streams is sent all of them in turn") {
  Outbox outbox;
  const std::vector<std::string> topics{"pose/a", "pose/b", "pose/c", "pose/d", "pose/e"};
  Texts sent;
  for (int round = 0; round < 5; ++round) {
    outbox.ready();
    for (const std::string& topic : topics) outbox.put_thinned(topic, of(topic));
    for (int i = 0; i < 2; ++i) {
      const auto parcel = outbox.next();
      REQUIRE(parcel);
      sent.push_back(*parcel->bytes);
    }
  }
  for (std::size_t i = 0; i < sent.size(); ++i) CHECK(sent[i] == topics[i % topics.size()]);
}

TEST_CASE("what waits of a stream that has left, or of a daemon that has gone, is not sent") {
  Outbox outbox;
  outbox.ready();
  for (const char* topic : {"pose/a", "pose/b"}) outbox.put_thinned(topic, of(topic));
  outbox.put_newest("skeleton/a", of("skeleton"));
  outbox.forget("pose/a");
  outbox.forget("skeleton/a");
  outbox.forget("pose/none");
  CHECK(taken(outbox) == Texts{"pose/b"});
  outbox.put_newest("stats", of("old"));
  outbox.put_event(of("told"));
  outbox.forget_all();
  CHECK(taken(outbox) == Texts{"told"});
}

}  // namespace
}  // namespace posed::view
