#include "daemon/net/refusal_words.hpp"

namespace posed::net {
namespace {

std::string other_socket(Domain domain) {
  return std::string("this is not its ") + (domain == Domain::kPublish ? "publish" : "control") +
         " endpoint (by default 5570 publishes, 5571 takes control)";
}

}  // namespace

std::string refusal_words(Refusal refusal, Domain domain, const std::filesystem::path& server_key) {
  switch (refusal) {
    case Refusal::kNone:
      break;
    case Refusal::kKeyNotAllowed:
      return std::string("refuses this key: it is not on its list, or may not ") +
             (domain == Domain::kPublish ? "subscribe" : "control");
    case Refusal::kTalksNoKeys:
      return "does not use keys, or is not posed; leave out --key";
    case Refusal::kHangsUp:
      return "hangs up: --server-key " + server_key.string() + " is not its key, or it just ended";
    case Refusal::kWantsKey:
      return "wants a key; give --key NAME.key --server-key SERVER.pub";
    case Refusal::kOtherSocket:
      return "hangs up: " + other_socket(domain);
    case Refusal::kHangsUpKeyless:
      return "hangs up: it wants a key (--key NAME.key --server-key SERVER.pub), or " +
             other_socket(domain);
  }
  return {};
}

}  // namespace posed::net
