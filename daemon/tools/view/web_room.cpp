#include "daemon/tools/view/web_room.hpp"

#include <memory>
#include <utility>

#include "daemon/tools/view/tab_session.hpp"

namespace posed::view {

http::Answer WebRoom::answer(const http::Request& request) {
  const http::Answer answer = answer_to(request, site);
  if (!answer.upgrades() || tabs.size() < kMaxTabs) return answer;
  return http::refuse(503, "too many pages are open: close one\n");
}

void WebRoom::upgrade(boost::beast::tcp_stream stream, const http::Message& request) {
  std::make_shared<TabSession>(std::move(stream), *this)->start(request);
}

void WebRoom::turn(std::int64_t now_ns) {
  for (TabSession* tab : tabs) tab->check(now_ns);
}

}  // namespace posed::view
