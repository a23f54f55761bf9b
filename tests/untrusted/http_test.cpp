// A web page in the user's browser can POST any body to a port of this machine.
#include "posed/v1/control.pb.h"
#include "tests/untrusted/target.hpp"

namespace posed::test {
namespace {

// A frame of the unversioned ZMTP 1.0: its length with the flags, the flags, the body.
std::string old_frame(std::string_view body, bool more) {
  std::string bytes(1, static_cast<char>(body.size() + 1));
  bytes += more ? '\1' : '\0';
  return bytes.append(body);
}

TEST_CASE("the body of a web page's POST is not a message and stops nothing") {
  Target target;
  target.start();
  v1::ControlRequest stop;
  stop.mutable_stop();
  // "POST" parses as a frame of 80 bytes that names the peer, followed by the page's own frames.
  // libzmq continues reading as long as they are well formed.
  std::string post = "POST /" + std::string(60, 'x') + " HTTP/1.1\r\n";
  post.resize(81, 'y');
  for (int i = 0; i < 4; ++i) {
    post += old_frame("", true) + old_frame(stop.SerializeAsString(), false);
  }
  const RawPeer page(target.control);
  CHECK(page.send(post));
  CHECK(page.hung_up());  // refused at once, not after the handshake's deadline
  CHECK_FALSE(target.daemon->exit_code(std::chrono::milliseconds(300)));

  const RawPeer subscriber(target.publish);
  CHECK(subscriber.send(post));
  CHECK(subscriber.hung_up());
  CHECK(target.ctl({"status"}).code == 0);
  CHECK(target.ctl({"stop"}).code == 0);
  CHECK(target.daemon->exit_code() == 0);
}

TEST_CASE("ZMTP 2.0 and 1.0 with a signature are refused, too") {
  Target target;
  target.start();
  for (const char version : {'\0', '\1'}) {
    const RawPeer old(target.control);
    std::string greeting("\xff\0\0\0\0\0\0\0\1\x7f", 10);
    greeting += version;
    greeting += '\5';  // DEALER
    CHECK(old.send(greeting + std::string(4, '\0')));
    CHECK(old.hung_up());
  }
}

}  // namespace
}  // namespace posed::test
