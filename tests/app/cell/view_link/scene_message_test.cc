// Tests of the viewers' message to the daemon, over a real socket.
#include "app/cell/view_link/scene_message.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "app/cell/view_link/view_client.h"
#include "app/cell/view_link/view_publisher.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::scene_message_test {

using namespace plumbline::cell;

TEST_CASE("a scene message is decoded only if complete and plausible") {
  const status::SceneStatus scene{.interferences = 2,
                                  .near = 5,
                                  .unmeasured = 1,
                                  .smallest_m = 0.0125,
                                  .object_a = 3,
                                  .object_b = 17};
  const SceneMessage message = EncodeScene(scene);
  const auto read = DecodeScene(message);
  REQUIRE(read);
  CHECK(read->interferences == 2);
  CHECK(read->near == 5);
  CHECK(read->unmeasured == 1);
  CHECK(read->smallest_m == Approx(0.0125));
  CHECK(read->object_a == 3);
  CHECK(read->object_b == 17);
  CHECK(DecodeScene(EncodeScene({})));  // nothing measured

  for (std::size_t size = 0; size < message.size(); ++size) {
    CHECK_FALSE(DecodeScene(std::span(message).first(size)));
  }
  std::vector<std::uint8_t> longer(message.begin(), message.end());
  longer.push_back(0);
  CHECK_FALSE(DecodeScene(longer));
  const auto spoilt = [&](status::SceneStatus wrong) {
    return DecodeScene(EncodeScene(wrong)).has_value();
  };
  CHECK_FALSE(spoilt({5001, 0, 0, 0, 1, 2}));
  CHECK_FALSE(spoilt({0, 5001, 0, 0, 1, 2}));
  CHECK_FALSE(spoilt({0, 0, 0xFFFFFFFF, 0, 1, 2}));
  CHECK_FALSE(spoilt({0, 0, 0, -0.001, 1, 2}));
  CHECK_FALSE(spoilt({0, 0, 0, NAN, 1, 2}));
  CHECK_FALSE(spoilt({0, 0, 0, INFINITY, 1, 2}));
  CHECK_FALSE(spoilt({0, 0, 0, 0.1, 10000, 2}));
  CHECK_FALSE(spoilt({0, 0, 0, 0.1, 1, 0}));
  CHECK_FALSE(spoilt({0, 0, 0, 0.1, 0, 0}));
  // Changing any byte yields a message within the limits, or none.
  for (std::size_t at = 0; at < message.size(); ++at) {
    for (int value = 0; value < 256; ++value) {
      SceneMessage other = message;
      other[at] = static_cast<std::uint8_t>(value);
      const auto taken = DecodeScene(other);
      if (at < 8 && other != message) CHECK_FALSE(taken);
      if (!taken) continue;
      CHECK(taken->interferences <= kMaxScenePairs);
      CHECK((taken->smallest_m >= 0 && taken->smallest_m <= 1000));
    }
  }
}

TEST_CASE("the daemon accepts scene messages from its own user only and ignores malformed ones") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/view.socket";
  auto publisher = ViewPublisher::Open(path);
  REQUIRE(publisher);
  ViewPublisher& daemon = **publisher;
  ViewClient viewer(path);
  View view;
  static_cast<void>(viewer.Read(0, view));
  REQUIRE(viewer.connected());
  REQUIRE(daemon.PollViewers());
  CHECK_FALSE(daemon.scene());
  viewer.SendScene({1, 0, 0, 0, 3, 17});
  REQUIRE(daemon.PollViewers());
  REQUIRE(daemon.scene());
  CHECK(daemon.scene()->interferences == 1);
  CHECK(daemon.scene()->time_s > 0);
  for (int k = 0; k < 100; ++k) viewer.SendScene({0, 0, 0, 1e-3 * k, 3, 17});
  for (int polls = 0; polls < 20; ++polls) REQUIRE(daemon.PollViewers());
  viewer.SendScene({0, 0, 0, 0.5, 3, 17});  // the newest counts, however many came before
  REQUIRE(daemon.PollViewers());
  CHECK(daemon.scene()->smallest_m == Approx(0.5));
  const status::SceneStatus before = *daemon.scene();

  const auto send_text = [&](const std::string& words) {
    const int socket = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, path.c_str());
    const bool sent =
        connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
        send(socket, words.data(), words.size(), MSG_NOSIGNAL) ==
            static_cast<ssize_t>(words.size());
    return std::pair(socket, sent);
  };
  for (const std::string& words :
       {std::string("x"), std::string(kSceneMessageBytes, 'x'), std::string(60000, 'x')}) {
    const auto [socket, sent] = send_text(words);
    CHECK(sent);
    REQUIRE(daemon.PollViewers());
    CHECK(daemon.scene()->time_s == before.time_s);
    close(socket);
  }

  if (geteuid() != 0) {
    WARN("SKIPPED: acting as another user needs root");
    return;
  }
  chmod(folder.path().c_str(), 0755);
  chmod(path.c_str(), 0666);
  const SceneMessage message = EncodeScene({9, 0, 0, 0, 3, 17});
  REQUIRE(seteuid(65534) == 0);
  const auto [socket, sent] = send_text(std::string(message.begin(), message.end()));
  REQUIRE(seteuid(0) == 0);
  CHECK(sent);
  REQUIRE(daemon.PollViewers());
  CHECK(daemon.scene()->interferences != 9);
  close(socket);
}

}  // namespace plumbline::scene_message_test
