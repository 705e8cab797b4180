#include "app/plant/broker/subscriber.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "app/plant/broker/broker_link.h"
#include "tests/app/plant/broker/broker_process.h"

namespace plumbline::plant::subscriber_test {

SubscriberSettings SettingsFor(const test::BrokerProcess& broker) {
  SubscriberSettings settings;
  settings.host = "127.0.0.1";
  settings.port = broker.port();
  settings.client_id = "reader";
  settings.topic = "plumblineV1/+/+/+";
  return settings;
}

std::unique_ptr<Subscriber> Subscribed(const test::BrokerProcess& broker) {
  auto made = Subscriber::Connect(SettingsFor(broker));
  INFO((made ? "" : made.error()));
  REQUIRE(made.ok());
  auto subscriber = std::move(made).value();
  std::vector<Received> none;
  REQUIRE(test::Soon([&] {
    REQUIRE(subscriber->Acknowledge().ok());
    REQUIRE(subscriber->Read(10, none.size() + 1, none).ok());
    return subscriber->subscribed();
  }));
  return subscriber;
}

void Publish(const test::BrokerProcess& broker, int count) {
  config::MqttConfig config;
  config.host = "127.0.0.1";
  config.port = broker.port();
  config.client_id = "writer";
  BrokerLink link(config, {});
  std::int64_t connection = 0;
  REQUIRE(test::Soon([&] { return (connection = link.TakeStatus().connection) != 0; }));
  std::vector<Outgoing> messages;
  for (int k = 1; k <= count; ++k) {
    messages.push_back({k, "plumblineV1/a/NDATA/b", std::to_string(k), false});
  }
  link.Publish(connection, messages);
  int acknowledged = 0;
  REQUIRE(test::Soon([&] {
    acknowledged += static_cast<int>(link.TakeStatus().acknowledged.size());
    return acknowledged == count;
  }));
}

/// Reads without acknowledging until nothing more comes.
std::vector<Received> ReadAll(Subscriber& subscriber, std::size_t expected) {
  std::vector<Received> messages;
  static_cast<void>(test::Soon(
      [&] {
        REQUIRE(subscriber.Read(10, 100'000, messages).ok());
        return messages.size() >= expected;
      },
      20));
  return messages;
}

TEST_CASE("the broker repeats what was read and not acknowledged, and nothing else") {
  if (test::MosquittoProgram().empty()) {
    WARN("SKIPPED: no mosquitto here");
    return;
  }
  constexpr int kMessages = 2500;  // more than a broker sends to others without acknowledgement
  const test::BrokerProcess broker;
  {
    const auto subscriber = Subscribed(broker);
    CHECK_FALSE(subscriber->session_kept());
    Publish(broker, kMessages);
    CHECK(ReadAll(*subscriber, kMessages).size() == kMessages);
  }
  {
    const auto subscriber = Subscriber::Connect(SettingsFor(broker)).value();
    REQUIRE(subscriber->Acknowledge().ok());
    std::vector<Received> messages;
    REQUIRE(test::Soon([&] {
      REQUIRE(subscriber->Read(10, 100'000, messages).ok());
      return messages.size() >= kMessages;
    }));
    CHECK(subscriber->session_kept());
    CHECK(messages.size() == kMessages);
    CHECK(messages.front().payload == "1");
    CHECK(messages.back().payload == std::to_string(kMessages));
    REQUIRE(subscriber->Acknowledge().ok());
    std::vector<Received> none;  // the acknowledgements are on their way
    REQUIRE(subscriber->Read(200, 10, none).ok());
  }
  const auto subscriber = Subscribed(broker);
  CHECK(ReadAll(*subscriber, 0).empty());
  Publish(broker, 1);
  CHECK(ReadAll(*subscriber, 1).size() == 1);
}

TEST_CASE("a broker that does not allow the subscription is named") {
  if (test::MosquittoProgram().empty()) {
    WARN("SKIPPED: no mosquitto here");
    return;
  }
  const test::BrokerProcess broker("allow_anonymous false\n");
  auto subscriber = Subscriber::Connect(SettingsFor(broker));
  REQUIRE(subscriber.ok());
  std::string problem;
  REQUIRE(test::Soon([&] {
    const auto sent = subscriber.value()->Acknowledge();
    std::vector<Received> none;
    const auto read = subscriber.value()->Read(10, 1, none);
    if (!sent) problem = sent.error();
    if (!read) problem = read.error();
    return !problem.empty();
  }));
  CHECK(problem == "Not authorized");
}

}  // namespace plumbline::plant::subscriber_test
