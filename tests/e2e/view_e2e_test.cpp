// `posed view` between a real daemon and a page.
#include <catch2/catch.hpp>

#include <chrono>
#include <csignal>
#include <string>
#include <vector>

#include "posed/v1/posed.pb.h"
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"
#include "tests/e2e/view_client.hpp"
#include "tests/support/asked_again.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/has.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

v1::ControlRequest alpha(double value) {
  v1::ControlRequest request;
  request.mutable_set_parameter()->set_stream("walker");
  request.mutable_set_parameter()->set_name("alpha");
  request.mutable_set_parameter()->set_number(value);
  return request;
}

v1::Frame frame_of(const ViewMessage& message) {
  v1::Frame frame;
  REQUIRE(frame.ParseFromString(message.body));
  return frame;
}

TEST_CASE("a page is greeted, gets the skeletons, and poses as fast as it asks for them",
          "[view]") {
  Served served;
  served.start();
  const ViewProcess view(served.publish, served.control);
  PageClient page(view);
  REQUIRE(page.is_open());
  const auto hello = page.next();
  REQUIRE(hello);
  CHECK(hello->word().at("type") == "hello");
  CHECK(hello->word().at("connect") == served.publish);
  CHECK(hello->word().at("same_machine") == true);
  v1::Skeleton skeleton;
  const auto first = page.next_of("skeleton/walker");
  REQUIRE(first);
  REQUIRE(skeleton.ParseFromString(first->body));
  CHECK(skeleton.joint_name_size() > 3);
  REQUIRE(page.next_of("stats"));

  std::uint64_t before = 0;
  for (int i = 0; i < 30; ++i) {
    page.ready();
    const auto pose = page.next_of("pose/walker");
    REQUIRE(pose);
    const v1::Frame frame = frame_of(*pose);
    CHECK(frame.sequence() > before);
    CHECK(frame.skeleton_id() == skeleton.id());
    before = frame.sequence();
  }
  // Without a credit nothing but stats comes any more, although the daemon sends 120 poses a
  // second.
  static_cast<void>(page.next_of("stats"));
  for (int i = 0; i < 2; ++i) {
    const auto message = page.next();
    REQUIRE(message);
    CHECK(message->topic == "stats");
  }
  page.say(R"({"type":"clock","t0":17.25})");
  const auto clock = page.next_word("clock");
  REQUIRE(clock);
  CHECK(clock->at("t0") == 17.25);
  page.ready();
  const auto pose = page.next_of("pose/walker");
  REQUIRE(pose);
  // What waits is the newest pose, not the next one.
  CHECK(frame_of(*pose).sequence() > before + 60);
  const auto clock_ns = std::stoll(clock->at("monotonic_ns").get<std::string>());
  CHECK(std::abs(clock_ns - frame_of(*pose).arrival_ns()) < 1'000'000'000);
}

TEST_CASE("a page changes alpha and gets the daemon's answer, but may not end the daemon",
          "[view]") {
  Served served;
  served.start();
  const ViewProcess view(served.publish, served.control);
  PageClient page(view);
  REQUIRE(page.comes_to_control(true));
  std::optional<v1::ControlReply> done;
  // At once, not with the statistics of the next second.
  const auto took = asked_again(
      [&] {
        const auto start = std::chrono::steady_clock::now();
        page.ask(7, alpha(0.25));
        done = page.reply(7);
        return std::chrono::steady_clock::now() - start;
      },
      [](auto time) { return time < 300ms; });
  REQUIRE(done);
  CHECK(done->ok());
  CHECK(done->stream() == "walker");
  CHECK(done->sequence() > 0);
  CHECK(took < 300ms);

  v1::ControlRequest status;
  status.mutable_status();
  page.ask(8, status);
  const auto state = page.reply(8);
  REQUIRE(state);
  CHECK(state->status().stream(0).alpha_target() == Approx(0.25));
  page.ask(9, alpha(99.0));
  CHECK_FALSE(page.reply(9)->ok());
  v1::ControlRequest stop;
  stop.mutable_stop();
  page.ask(10, stop);
  const auto refused = page.reply(10);
  REQUIRE(refused);
  CHECK(has(refused->error(), "posed ctl stop"));
  CHECK(served.ctl({"status"}).code == 0);
}

TEST_CASE("who has no token, a wrong one, or another page's origin is refused", "[view]") {
  Served served;
  served.start();
  const ViewProcess view(served.publish, served.control);
  const std::string page = view.answer("GET /?token=" + view.token);
  CHECK(has(page, "<p>the page"));
  CHECK(has(page, "Content-Security-Policy: default-src 'none'; script-src 'self'"));
  CHECK(has(page, "Referrer-Policy: no-referrer"));
  CHECK(has(view.answer("GET /"), "posed prints it"));
  CHECK(view.status("GET /?token=wrong") == 403);
  CHECK(view.status("GET /page.js") == 200);
  CHECK_FALSE(has(view.answer("HEAD /page.js"), "run()"));
  for (const char* path : {"/../posed.toml", "/..%2fposed.toml", "//etc/passwd", "/%2e%2e/"}) {
    INFO(path);
    CHECK(view.status(std::string("GET ") + path) == 404);
  }
  CHECK(view.status("POST /?token=" + view.token, "Content-Length: 3\r\n") == 405);
  CHECK(view.status("GET /ws?token=" + view.token) == 404);

  CHECK(PageClient(view).is_open());
  const std::string own = "http://" + view.host;
  for (const auto& [origin, token] :
       {std::pair<std::string, std::string>{"http://evil.example", view.token},
        {"null", view.token},
        {own, "wrong"},
        {own, ""}}) {
    INFO(origin << " " << token);
    const PageClient stranger(view, origin, token);
    CHECK_FALSE(stranger.is_open());
    CHECK(stranger.refusal() == 403);
  }
}

TEST_CASE("a read-only page shows everything and changes nothing", "[view]") {
  Served served;
  served.start();
  const ViewProcess view(served.publish, served.control, {"--read-only"});
  PageClient page(view);
  const auto hello = page.next_word("hello");
  REQUIRE(hello);
  CHECK(hello->at("may_control") == false);
  CHECK(has(hello->at("read_only_reason"), "--read-only"));
  page.ask(1, alpha(0.25));
  const auto refused = page.reply(1);
  REQUIRE(refused);
  CHECK_FALSE(refused->ok());
  CHECK(has(refused->error(), "--read-only"));
  page.ready();
  CHECK(page.next_of("pose/walker"));

  // Without a control endpoint the same, and the page says what is missing.
  const ViewProcess deaf(served.publish, "");
  PageClient other(deaf);
  CHECK(has(other.next_word("hello")->at("read_only_reason"), "--control"));
}

TEST_CASE("a page whose key may not control says so, and one whose key may, controls", "[view]") {
  Served served;
  for (const char* name : {"server", "owner", "guest", "stranger"}) {
    REQUIRE(posed({"keygen", name, "--out", served.folder.path().string()}).code == 0);
  }
  served.write_config(
      "[security]\nserver_key = \"server.key\"\n"
      "[[security.client]]\nname = \"owner\"\npublic_key = \"owner.pub\"\n"
      "rights = [\"subscribe\", \"control\"]\n"
      "[[security.client]]\nname = \"guest\"\npublic_key = \"guest.pub\"\n");
  served.start();
  const auto as = [&](const std::string& who) {
    return std::vector<std::string>{"--key", served.path(who + ".key"), "--server-key",
                                    served.path("server.pub")};
  };
  const ViewProcess owner(served.publish, served.control, as("owner"));
  PageClient owners(owner);
  REQUIRE(owners.comes_to_control(true));
  owners.ask(1, alpha(0.5));
  CHECK(owners.reply(1)->ok());

  const ViewProcess guest(served.publish, served.control, as("guest"));
  PageClient guests(guest);
  guests.ready();
  CHECK(guests.next_of("pose/walker"));
  guests.ask(1, alpha(0.5));
  const auto refused = guests.reply(1);
  REQUIRE(refused);
  CHECK(has(refused->error(), "may not control"));

  const ViewProcess stranger(served.publish, served.control, as("stranger"));
  PageClient strangers(stranger);
  for (std::string sentence; !has(sentence, "refuses this key");) {
    const auto word = strangers.next_word("daemon");
    REQUIRE(word);
    sentence = word->at("sentence");
  }
}

TEST_CASE("a page is told when its daemon goes, and is live again when it returns", "[view]") {
  Stage stage;
  const auto publish = "tcp://127.0.0.1:" + std::to_string(free_port());
  const auto control = "tcp://127.0.0.1:" + std::to_string(free_port());
  REQUIRE(clip::write_bvh(toy_walk(240, 120.0), stage.folder.path() / "walk.bvh"));
  stage.folder.write("posed.toml", "realtime = false\n[publish]\nendpoint = \"" + publish +
                                       "\"\n[control]\nendpoint = \"" + control + "\"\n" +
                                       Stage::kWalker);
  const ViewProcess view(publish, control);  // before the daemon
  PageClient page(view);
  const auto waiting = page.next_word("daemon");
  REQUIRE(waiting);
  CHECK(waiting->at("alive") == false);
  CHECK(has(waiting->at("sentence"), publish));
  stage.launch("run");
  page.ready();
  REQUIRE(page.next_of("pose/walker"));

  const auto took = asked_again(
      [&] {
        stage.daemon->send(SIGKILL);
        REQUIRE(stage.daemon->exit_code());
        for (bool alive = true; alive;) {
          const auto word = page.next_word("daemon");
          REQUIRE(word);
          alive = word->at("alive");
        }
        stage.launch("run");
        const auto start = std::chrono::steady_clock::now();
        page.ready();
        REQUIRE(page.next_of("skeleton/walker"));
        page.ready();
        REQUIRE(page.next_of("pose/walker"));
        return std::chrono::steady_clock::now() - start;
      },
      [](auto time) { return time < 3s; });
  CHECK(took < 3s);
  REQUIRE(page.comes_to_control(true));
  v1::ControlRequest status;
  status.mutable_status();
  page.ask(1, status);
  const auto reply = page.reply(1);
  REQUIRE(reply);
  CHECK(reply->ok());
}

TEST_CASE("view says in one sentence what it cannot do, and ctrl-c ends it", "[view]") {
  const TempFolder empty;
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"view", "--no-browser", "--port", "0"});
    return posed(std::move(options));
  };
  const auto none = with({"--page", empty.path().string()});
  CHECK(none.code == 1);
  CHECK(has(none.err, "./run page"));
  CHECK(with({"--page", "/nonexistent"}).code == 1);
  static_cast<void>(empty.write("index.html", "x"));
  const auto bad = with({"--page", empty.path().string(), "--bind", "nowhere"});
  CHECK(bad.code == 2);
  CHECK(has(bad.err, "'nowhere'"));

  Process open({"view", "--no-browser", "--port", "0", "--page", empty.path().string(), "--bind",
                "0.0.0.0"});
  const auto url = open.line();
  REQUIRE(url);
  CHECK(url->starts_with("http://127.0.0.1:"));
  CHECK(open.comes_to_say("warning: ... other machines ... 0.0.0.0"));
  open.send(SIGINT);
  CHECK(open.exit_code() == 0);
}

}  // namespace
}  // namespace posed::test
