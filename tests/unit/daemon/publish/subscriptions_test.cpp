#include <catch2/catch.hpp>

#include "daemon/publish/subscriptions.hpp"
#include "proto/frame/time.hpp"

namespace posed::publish {
namespace {

bool is_walker(std::string_view prefix) {
  return std::string_view("pose/walker").starts_with(prefix);
}

TEST_CASE("which prefixes could become a topic") {
  for (const char* prefix : {"", "p", "pose", "pose/", "pose/left-hand_2", "skeleton/x-raw",
                             "sensor/", "event/a", "s", "stats", "sta"}) {
    CAPTURE(prefix);
    CHECK(could_become_topic(prefix));
  }
  for (const char* prefix :
       {"x", "Pose/", "pose/A", "pose/a/b", "stats/", "statsx", "pose//", " "}) {
    CAPTURE(prefix);
    CHECK_FALSE(could_become_topic(prefix));
  }
  CHECK(could_become_topic("pose/" + std::string(36, 'a')));
  CHECK_FALSE(could_become_topic("pose/" + std::string(37, 'a')));
}

TEST_CASE("existing topics cost nothing; others are counted once each, until their peer leaves") {
  Subscriptions subscriptions(is_walker);
  CHECK(subscriptions.ask(1, "pose/walker", true, 0));
  CHECK(subscriptions.ask(1, "", true, 0));
  CHECK(subscriptions.wanted() == 0);
  for (const int peer : {1, 2, 1}) CHECK(subscriptions.ask(peer, "pose/runner", true, 0));
  CHECK(subscriptions.wanted() == 1);
  CHECK(subscriptions.ask(1, "pose/runner", false, 0));
  CHECK(subscriptions.wanted() == 1);                    // the second peer still waits for it
  CHECK(subscriptions.ask(1, "pose/runner", false, 0));  // unsubscribing twice does no harm
  subscriptions.forget(2);
  CHECK(subscriptions.wanted() == 0);
}

TEST_CASE("the subscriptions that match no topic yet, or never can, are limited") {
  Subscriptions subscriptions(is_walker);
  for (std::size_t i = 0; i < kMaxWanted; ++i) {
    const int peer = static_cast<int>(i % 4);
    REQUIRE(subscriptions.ask(peer, "pose/" + std::to_string(i), true, 0));
  }
  CHECK_FALSE(subscriptions.ask(5, "pose/one-more", true, 0));
  CHECK(subscriptions.ask(5, "pose/walker", true, 0));
  for (std::size_t i = 0; i < kMaxImpossible; ++i) {
    REQUIRE(subscriptions.ask(6, "nonsense " + std::to_string(i), true, 0));
  }
  CHECK_FALSE(subscriptions.ask(6, "nonsense", true, 0));
  subscriptions.forget(0);
  subscriptions.forget(1);
  subscriptions.forget(5);
  CHECK(subscriptions.wanted() == kMaxWanted / 2);
}

TEST_CASE("one peer cannot use up the subscriptions that all have together") {
  Subscriptions subscriptions(is_walker);
  int asked = 0;
  while (subscriptions.ask(1, "pose/" + std::to_string(asked), true, 0)) {
    REQUIRE(++asked < static_cast<int>(kMaxWanted) / 2);
  }
  CHECK(subscriptions.ask(2, "pose/mine", true, 0));
}

TEST_CASE("the first subscription to a prefix is told, and the end of the last one") {
  std::string reported;
  Subscriptions subscriptions([](std::string_view) { return false; },
                              [&](const std::string& prefix, bool wanted) {
                                reported += (wanted ? "+" : "-") + prefix + " ";
                              });
  for (const int peer : {1, 2, 1}) CHECK(subscriptions.ask(peer, "pose/a", true, 0));
  CHECK(subscriptions.ask(2, "nonsense", true, 0));  // never a topic: nobody need hear of it
  CHECK(subscriptions.ask(2, "stats", true, 0));
  CHECK(reported == "+pose/a +stats ");
  CHECK(subscriptions.ask(1, "pose/a", false, 0));
  CHECK(reported == "+pose/a +stats ");
  subscriptions.forget(2);
  CHECK(reported == "+pose/a +stats -pose/a -stats ");
}

TEST_CASE("a peer that subscribes too often is refused, and admitted again later") {
  Subscriptions subscriptions(is_walker);
  int asked = 0;
  while (subscriptions.ask(1, "pose/", true, 0)) REQUIRE(++asked < 10'000);
  CHECK(asked == 8192);
  CHECK(subscriptions.ask(2, "pose/", true, 0));  // another peer is not affected
  CHECK(subscriptions.ask(1, "pose/", true, kNanosPerSecond));
}

}  // namespace
}  // namespace posed::publish
