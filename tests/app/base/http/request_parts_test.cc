#include "app/base/http/request_parts.h"

#include <catch2/catch.hpp>

#include "app/base/http/login_throttle.h"

namespace plumbline::request_parts_test {

using namespace plumbline::http;

TEST_CASE("secrets are equal only if every byte is") {
  CHECK(SameSecret("0123456789abcdef", "0123456789abcdef"));
  CHECK_FALSE(SameSecret("0123456789abcdeF", "0123456789abcdef"));
  CHECK_FALSE(SameSecret("1123456789abcdef", "0123456789abcdef"));
  CHECK_FALSE(SameSecret("0123456789abcde", "0123456789abcdef"));
  CHECK_FALSE(SameSecret("0123456789abcdef0123456789abcdef", "0123456789abcdef"));
  CHECK_FALSE(SameSecret("", "0123456789abcdef"));
  CHECK_FALSE(SameSecret("x", ""));
  CHECK_FALSE(SameSecret(std::string_view("\0", 1), ""));
}

TEST_CASE("the waiting time doubles with each wrong token of an address") {
  LoginThrottle limit;
  double now_s = 1000;
  std::uint64_t guess = 0;
  for (int k = 0; k < LoginThrottle::kFreeFailures; ++k) {
    CHECK(limit.Wait_s("10.0.0.7", now_s) == 0);
    limit.Failed("10.0.0.7", ++guess, now_s);
  }
  for (const double wait_s : {1, 2, 4, 8, 16, 32, 64, 128, 256, 300, 300}) {
    CHECK(limit.Wait_s("10.0.0.7", now_s) == wait_s);
    CHECK(limit.Wait_s("10.0.0.8", now_s) == 0);
    now_s += wait_s;
    limit.Failed("10.0.0.7", ++guess, now_s);
  }
  now_s += 2 * LoginThrottle::kForgetAfter_s;
  limit.Failed("10.0.0.7", ++guess, now_s);
  CHECK(limit.Wait_s("10.0.0.7", now_s) == 0);
  for (int k = 0; k < 9; ++k) limit.Failed("10.0.0.7", ++guess, now_s);
  CHECK(limit.Wait_s("10.0.0.7", now_s) > 0);
  limit.Succeeded("10.0.0.7");
  CHECK(limit.Wait_s("10.0.0.7", now_s) == 0);
}

TEST_CASE("an IPv6 network counts as one address, and memory is bounded") {
  LoginThrottle limit;
  for (int k = 0; k < 9; ++k) limit.Failed("2001:db8::" + std::to_string(k), k, 5);
  CHECK(limit.Wait_s("2001:db8::ffff", 5) > 0);
  CHECK(limit.Wait_s("2001:db8:0:1::1", 5) == 0);
  for (std::size_t k = 0; k < 3 * LoginThrottle::kMaxAddresses; ++k) {
    limit.Failed("host" + std::to_string(k), k, 6);
  }
  CHECK(limit.Wait_s("2001:db8::ffff", 6) == 0);  // longest silent, so that others fit
}

TEST_CASE("the bearer token is parsed") {
  CHECK(BearerToken("Bearer abc") == "abc");
  CHECK(BearerToken("  bearer   a;b=c  ") == "a;b=c");
  CHECK_FALSE(BearerToken("Basic abc"));
  CHECK_FALSE(BearerToken("Bearer"));
  CHECK_FALSE(BearerToken("Bearer "));
  CHECK_FALSE(BearerToken(""));
  CHECK_FALSE(BearerToken("Bearerabc"));
}

TEST_CASE("a cookie is found among others") {
  CHECK(CookieOf("plumbline-80=ab", "plumbline-80") == "ab");
  CHECK(CookieOf("a=1; plumbline-80=ab;c=d", "plumbline-80") == "ab");
  CHECK(CookieOf("plumbline-80=", "plumbline-80") == "");
  CHECK(CookieOf(" plumbline-80 = ab ", "plumbline-80") == "ab");
  CHECK(CookieOf("plumbline-80=first; plumbline-80=second", "plumbline-80") == "first");
  CHECK_FALSE(CookieOf("xplumbline-80=ab", "plumbline-80"));
  CHECK_FALSE(CookieOf("plumbline-8080=ab", "plumbline-80"));
  CHECK_FALSE(CookieOf("plumbline-80", "plumbline-80"));
  CHECK_FALSE(CookieOf(";;;", "plumbline-80"));
  CHECK_FALSE(CookieOf("", "plumbline-80"));
  CHECK(CookieValueOf("a;\xff") == "613bff");
}

TEST_CASE("the host is parsed from the Host header") {
  CHECK(HostOf("Cell7.Plant.Example:8080") == "cell7.plant.example");
  CHECK(HostOf("192.168.0.3") == "192.168.0.3");
  CHECK(HostOf("[::1]:8080") == "::1");
  CHECK(HostOf("[FE80::1]") == "fe80::1");
  CHECK(HostOf("localhost:") == "localhost");
  CHECK_FALSE(HostOf(std::string("[::\0/a]", 7)));  // an address up to a zero byte
  CHECK_FALSE(IsOwnHost(std::string("::\0.evil.example", 16), {}));
  for (const char* const none : {"", ":80", "a b", "a/b", "[::1", "[name]", "[1.2.3.4]", "[::1]x",
                                 "a:b", "a:123456", "a:80:80", "user@host", "a\tb"}) {
    INFO(none);
    CHECK_FALSE(HostOf(none));
  }
  CHECK_FALSE(HostOf(std::string(254, 'a')));
}

TEST_CASE("only addresses and own names are accepted as host") {
  const std::vector<std::string> own = {"cell7.plant.example", "cell7"};
  for (const char* const ours :
       {"127.0.0.1", "::1", "10.0.0.7", "localhost", "cell7", "cell7.plant.example"}) {
    CHECK(IsOwnHost(ours, own));
  }
  for (const char* const other : {"evil.example", "cell7.plant.example.evil.example",
                                  "127.0.0.1.nip.io", "cell", "localhost.evil.example", ""}) {
    CHECK_FALSE(IsOwnHost(other, own));
  }
}

}  // namespace plumbline::request_parts_test
