#include <chrono>
#include <string>

#include <catch2/catch.hpp>

#include "daemon/net/peer_guard.hpp"
#include "daemon/net/security.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "proto/zmq/keys.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::net {
namespace {

using namespace std::chrono_literals;

// One context as a daemon has it, with an authenticator, and another for the clients.
struct Stage {
  test::TempFolder folder;
  KeyPair server = *write_new_keys("server", folder.path());
  KeyPair viewer = *write_new_keys("viewer", folder.path());
  KeyPair director = *write_new_keys("director", folder.path());
  KeyPair unknown = *write_new_keys("unknown", folder.path());
  KeyPair other_server = *write_new_keys("other_server", folder.path());
  Context here = *open_context();
  Context there = *open_context();
  std::unique_ptr<ZapAuthenticator> authenticator =
      *ZapAuthenticator::start(here.get(), full_list());
  Socket publisher = *open_socket(here.get(), ZMQ_XPUB);
  std::unique_ptr<PeerGuard> guard = *PeerGuard::open(here.get(), publisher.get(),
                                                      {.name = "test",
                                                       .max_peers = 10,
                                                       .max_unfinished = 100'000,
                                                       .max_unfinished_of_all = 100'000});
  Socket router = *open_socket(here.get(), ZMQ_ROUTER);
  std::string pose_endpoint, control_endpoint;

  Stage() {
    // so that the publisher receives every subscription
    REQUIRE(set_option(publisher.get(), ZMQ_XPUB_VERBOSER, 1));
    REQUIRE(secure_server(publisher.get(), Domain::kPublish, server.secret_z85));
    REQUIRE(secure_server(router.get(), Domain::kControl, server.secret_z85));
    pose_endpoint = *bind_socket(publisher.get(), "tcp://127.0.0.1:*");
    control_endpoint = *bind_socket(router.get(), "tcp://127.0.0.1:*");
  }

  [[nodiscard]] AccessList full_list() const {
    return AccessList({{"viewer", viewer.public_z85, true, false},
                       {"director", director.public_z85, true, true}});
  }
  [[nodiscard]] AccessList without_viewer() const {
    return AccessList({{"director", director.public_z85, true, true}});
  }

  [[nodiscard]] Socket client(int type, const std::string& endpoint, const std::string& key,
                              const std::string& server_key = "server") const {
    Socket socket = *open_socket(there.get(), type);
    REQUIRE(set_option(socket.get(), ZMQ_RCVTIMEO, 50));
    if (!key.empty()) {
      REQUIRE(secure_client(socket.get(), folder.path() / (key + ".key"),
                            folder.path() / (server_key + ".pub")));
    }
    if (type == ZMQ_SUB) REQUIRE(set_option(socket.get(), ZMQ_SUBSCRIBE, ""));
    REQUIRE(connect_socket(socket.get(), endpoint));
    return socket;
  }

  // As the publisher does: so the guard learns which User-Id each connection has.
  void receive_subscriptions() const {
    Message message;
    while (message.receive(publisher.get())) {
      if (guard->knows(source_of(message))) {
        guard->received(source_of(message), message.property("User-Id"));
      }
    }
  }

  // Whether a published message reaches the subscriber in time. Reads old messages first.
  [[nodiscard]] bool receives(void* subscriber, std::chrono::milliseconds within) const {
    Message message;
    while (message.receive(subscriber)) {
    }
    const auto end = std::chrono::steady_clock::now() + within;
    while (std::chrono::steady_clock::now() < end) {
      (void)send_part(publisher.get(), "pose", false);
      if (message.receive(subscriber, 0)) return true;
    }
    return false;
  }

  // Waits for a request at the control socket; returns its User-Id.
  [[nodiscard]] std::string sender_of_request(void* dealer,
                                              std::chrono::milliseconds within) const {
    (void)send_part(dealer, "hello", false);
    zmq_pollitem_t wait{router.get(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&wait, 1, within.count()) <= 0) return {};
    Message part;
    (void)part.receive(router.get());
    (void)part.receive(router.get());
    return std::string(part.property("User-Id"));
  }
};

constexpr auto kSoon = 5000ms;  // enough on any machine
constexpr auto kNever = 400ms;  // long enough for a handshake that must not happen

TEST_CASE("a listed key has the rights that the list gives it") {
  const Stage stage;
  const auto viewer = stage.client(ZMQ_SUB, stage.pose_endpoint, "viewer");
  CHECK(stage.receives(viewer.get(), kSoon));
  const auto director = stage.client(ZMQ_DEALER, stage.control_endpoint, "director");
  CHECK(stage.sender_of_request(director.get(), kSoon) == stage.director.public_z85);
  const auto reaching = stage.client(ZMQ_DEALER, stage.control_endpoint, "viewer");
  CHECK(stage.sender_of_request(reaching.get(), kNever).empty());
  CHECK(stage.authenticator->refused() > 0);
}

TEST_CASE("an unknown client receives nothing: no key, a key not listed, a wrong server key") {
  const Stage stage;
  const auto keyless = stage.client(ZMQ_SUB, stage.pose_endpoint, "");
  CHECK_FALSE(stage.receives(keyless.get(), kNever));
  const auto unlisted = stage.client(ZMQ_SUB, stage.pose_endpoint, "unknown");
  CHECK_FALSE(stage.receives(unlisted.get(), kNever));
  const auto misled = stage.client(ZMQ_SUB, stage.pose_endpoint, "viewer", "other_server");
  CHECK_FALSE(stage.receives(misled.get(), kNever));
  const auto good = stage.client(ZMQ_SUB, stage.pose_endpoint, "viewer");
  CHECK(stage.receives(good.get(), kSoon));
}

TEST_CASE("a subscriber whose key is withdrawn is disconnected, the others are not") {
  Stage stage;
  const auto viewer = stage.client(ZMQ_SUB, stage.pose_endpoint, "viewer");
  const auto director = stage.client(ZMQ_SUB, stage.pose_endpoint, "director");
  REQUIRE(stage.receives(viewer.get(), kSoon));
  REQUIRE(stage.receives(director.get(), kSoon));

  stage.receive_subscriptions();
  CHECK(stage.guard->peers() == 2);

  CHECK(stage.authenticator->replace(stage.without_viewer()));
  stage.guard->cut_unless(
      [&](std::string_view user) { return stage.authenticator->allows(user, Domain::kPublish); });
  CHECK(stage.guard->cuts() == 1);
  CHECK(stage.receives(director.get(), kSoon));
  CHECK_FALSE(stage.receives(viewer.get(), kNever));
  CHECK_FALSE(stage.authenticator->replace(stage.full_list()));
}

TEST_CASE("a controller whose key is withdrawn is known by the User-Id of its next message") {
  Stage stage;
  const auto director = stage.client(ZMQ_DEALER, stage.control_endpoint, "director");
  const std::string user = stage.sender_of_request(director.get(), kSoon);
  CHECK(stage.authenticator->allows(user, Domain::kControl));
  CHECK(stage.authenticator->replace(AccessList{}));
  CHECK(stage.sender_of_request(director.get(), kSoon) == user);
  CHECK_FALSE(stage.authenticator->allows(user, Domain::kControl));
}

TEST_CASE("without an authenticator a secured socket refuses every client") {
  Stage stage;
  stage.authenticator.reset();
  const auto viewer = stage.client(ZMQ_SUB, stage.pose_endpoint, "viewer");
  CHECK_FALSE(stage.receives(viewer.get(), kNever));
}

TEST_CASE("one context has one authenticator") {
  Stage stage;
  CHECK_FALSE(ZapAuthenticator::start(stage.here.get(), AccessList{}));
}

}  // namespace
}  // namespace posed::net
