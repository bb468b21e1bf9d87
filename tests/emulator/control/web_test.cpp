// Requests of a browser: the dashboard's files, read-only pages, decoded frames.

#include <gtest/gtest.h>

#include <boost/asio/post.hpp>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "emulator/io/control/http_access.hpp"
#include "emulator/io/control/streams.hpp"
#include "tests/emulator/control/http_support.hpp"

namespace lk::emulator {
namespace web_test {

TEST_F(HttpServer, ServesTheDashboardUnchanged) {
  options_.http = HttpAddress{"127.0.0.1", 0};
  options_.token_file = token_file("long enough for a token", fs::perms::owner_read);
  start();
  const auto ask_for = [&](const std::string& what, const std::string& more = "") {
    return ask_tcp(what + " HTTP/1.1\r\nHost: " + host() + "\r\n" + more + "\r\n");
  };
  const std::string page = ask_for("GET /");
  EXPECT_EQ(status(page), 200) << "the page is no secret; it asks for the token";
  EXPECT_NE(page.find("Content-Type: text/html; charset=utf-8\r\n"), std::string::npos);
  EXPECT_NE(page.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
  EXPECT_NE(ask_for("GET /app.js").find("Content-Type: text/javascript"), std::string::npos);
  std::ostringstream file;
  file << std::ifstream(LKEMU_SOURCE_DIR "/web/index.html").rdbuf();
  EXPECT_EQ(page.substr(page.find("\r\n\r\n") + 4), file.str());
  const std::size_t at = page.find("ETag: ") + 6;
  const std::string etag = page.substr(at, page.find('\r', at) - at);
  EXPECT_EQ(status(ask_for("GET /", "If-None-Match: " + etag + "\r\n")), 304);
  EXPECT_EQ(status(ask_for("GET /", "If-None-Match: \"other\"\r\n")), 200);
  EXPECT_EQ(status(ask_for("POST /", "Content-Length: 0\r\n")), 405);
  EXPECT_EQ(status(ask_for("GET /../CMakeLists.txt")), 401) << "nothing else is served";
  EXPECT_EQ(status(ask_tcp("GET / HTTP/1.1\r\nHost: example.com\r\n\r\n")), 403);
}

TEST_F(HttpServer, SetsTheLanguageOfThePage) {
  std::vector<std::string> etags;
  for (const std::string language : {"", "en", "zh"}) {
    options_.http = HttpAddress{"127.0.0.1", 0};
    options_.page_language = language;
    start();
    const auto ask_for = [&](const std::string& more) {
      return ask_tcp("GET / HTTP/1.1\r\nHost: " + host() + "\r\n" + more + "\r\n");
    };
    const std::string page = ask_for("");
    EXPECT_NE(page.find("<html lang=\"en\" data-lang=\"" + language + "\">"), std::string::npos);
    EXPECT_TRUE(page.ends_with("</html>\n"));
    // A browser with a cached page of the other language gets the right one.
    for (const std::string& other : etags) {
      EXPECT_EQ(status(ask_for("If-None-Match: " + other + "\r\n")), 200);
    }
    const std::size_t at = page.find("ETag: ") + 6;
    etags.push_back(page.substr(at, page.find('\r', at) - at));
    EXPECT_EQ(status(ask_for("If-None-Match: " + etags.back() + "\r\n")), 304);
    stop_and_reset();
  }
}

TEST_F(HttpServer, PageWritesOnlyIfAllowed) {
  for (const bool may : {false, true}) {
    options_.http = HttpAddress{"127.0.0.1", 0};
    options_.pages_may_write = may;
    start();
    const auto power_off = [&](const std::string& origin) {
      return send_tcp("POST /api/v1/directives", R"({"power": "off"})", origin);
    };
    EXPECT_EQ(power_off("Origin: http://" + host() + "\r\n"), may ? 200 : 403);
    EXPECT_EQ(power_off(""), 200) << "a program is no page";
    EXPECT_EQ(get_tcp("Host: " + host() + "\r\nOrigin: http://" + host() + "\r\n"), 200);
    stop_and_reset();
  }
}

TEST(HttpAccess, ReadsTokenFromSubprotocols) {
  EXPECT_EQ(authorization_of("lk-emu, bearer.61622d7a"), "Bearer ab-z");
  EXPECT_EQ(authorization_of("lk-emu,bearer.61622D7A "), "Bearer ab-z");
  for (const char* none : {"", "lk-emu", "bearer", "bearer.6", "bearer.6g", "bearer.+1", ",,"}) {
    EXPECT_EQ(authorization_of(none), "") << none;
  }
  EXPECT_TRUE(offers_protocol("bearer.61, lk-emu"));
  EXPECT_FALSE(offers_protocol("lk-emulator"));
}

const std::string kFrames = upgrade_at("/frames");

TEST_F(HttpServer, GroupsSamplesPerMessage) {
  start();
  const Client stream = client();
  stream.send(upgrade_at("/telemetry?signals=alive&ids=2&rate_Hz=1000&samples_per_message=3",
                         "Host: x\r\nSec-WebSocket-Protocol: lk-emu\r\n"));
  EXPECT_NE(stream.receive_until("\r\n\r\n").find("Sec-WebSocket-Protocol: lk-emu\r\n"),
            std::string::npos);
  stream.receive_until("}");
  EXPECT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.0045})"))), 200);
  // Samples at 0, 1, 2, 3 and 4 ms, at most three per list; the grouping depends on timing.
  std::size_t samples = 0;
  for (int messages = 0; samples < 5 && messages < 5; ++messages) {
    const std::string list = stream.receive_until("]}]");
    ASSERT_NE(list.find("[{\"time_s\":"), std::string::npos) << list;
    std::size_t here = 0;
    for (std::size_t at = 0; (at = list.find("\"time_s\":", at)) != std::string::npos; ++at) ++here;
    EXPECT_LE(here, 3U) << list;
    samples += here;
  }
  EXPECT_EQ(samples, 5U);
}

TEST_F(HttpServer, StreamsDecodedFrames) {
  start();
  const Client stream = open(kFrames);
  EXPECT_NE(stream.receive_until("}").find(R"({"bus":"vcan0"})"), std::string::npos);
  boost::asio::post(t_.loop, [this] {
    protocol::Frame frame;
    frame.id = 0x141;
    frame.dlc = 8;
    frame.data = {0xA4, 0, 0x2C, 0x01, 0x50, 0xC3, 0, 0};
    t_.world.lines().front()->accept({SimTime{0}, frame});
  });
  EXPECT_EQ(status(ask(post("/clock/advance", R"({"by_s": 0.01})"))), 200);
  // docs/reference/protocol.md: 0x012C = 300 dps, 0xC350 = 50000 of 0.01 degrees. The drive replies
  // with state 2.
  std::string told = stream.receive_until(R"("from":"drive")");
  told += stream.receive_until("]}");
  EXPECT_NE(told.find(R"("frame":"141#A4002C0150C30000","command":"A4")"), std::string::npos)
      << told;
  EXPECT_NE(told.find("angle_deg 500, max_speed_dps 300"), std::string::npos) << told;
  EXPECT_NE(told.find(R"("says":"angle 500°, max speed 300 °/s")"), std::string::npos) << told;
  EXPECT_NE(told.find(R"("says_zh":"角度 500°，最大速度 300 °/s")"), std::string::npos) << told;
  EXPECT_NE(told.find("iq_A"), std::string::npos) << told;
}

TEST_F(HttpServer, LimitsFrameStreams) {
  start();
  std::vector<Client> listeners;
  for (int n = 0; n < kMaxFrameStreams; ++n) listeners.push_back(open(kFrames));
  open(kFrames, 429);
}

TEST_F(HttpServer, CountsFramesMissedByASlowReader) {
  start();
  const Client sleeper = open(kFrames);
  for (int n = 0; n < 10; ++n) {  // more than a socket buffers, some hundred kilobytes each time
    boost::asio::post(t_.loop, [this] {
      for (int frames = 0; frames < 2000; ++frames) {
        t_.world.lines().front()->accept({SimTime{0}, test::frame("141#9C00000000000000")});
      }
    });
    ASSERT_EQ(status(ask(post("/clock/advance", R"({"by_s": 1})"))), 200);
  }
  EXPECT_TRUE(sleeper.receive_until("\"lost\":").ends_with("\"lost\":"));
}

TEST_F(HttpServer, RejectsFrameStreamWithoutUpgrade) {
  start();
  EXPECT_EQ(status(ask("GET /api/v1/frames?bus=vcan0 HTTP/1.1\r\n\r\n")), 426);
  EXPECT_EQ(status(ask("GET /api/v1/frames?ids=1 HTTP/1.1\r\n\r\n")), 400);
}

TEST_F(HttpServer, FramesCarryTheirAdvice) {
  start();
  const Client stream = open(kFrames);
  stream.receive_until("}");
  boost::asio::post(t_.loop, [this] {
    Line& line = *t_.world.lines().front();
    line.accept({SimTime{0}, test::frame("141#9C00000000000000")});
    line.accept({SimTime{0}, test::frame("141#9C0000")});
  });
  const std::string told = stream.receive_until("]}");
  const std::size_t right = told.find(R"("frame":"141#9C00000000000000")");
  const std::size_t wrong = told.find(R"("frame":"141#9C0000")");
  ASSERT_NE(right, std::string::npos) << told;
  ASSERT_NE(wrong, std::string::npos) << told;
  const std::size_t advice = told.find(R"("advice":"wrong-length")");
  EXPECT_GT(advice, wrong) << told;
  EXPECT_EQ(told.find("\"advice\""), advice) << "the other one is as it should be";
}

}  // namespace web_test
}  // namespace lk::emulator
