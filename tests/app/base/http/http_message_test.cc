// HTTP codec with requests of browsers, scripts and attackers.
#include "app/base/http/http_message.h"

#include <catch2/catch.hpp>

namespace plumbline::http_message_test {

using namespace plumbline::http;

namespace {

ParsedRequest Parsed(const std::string& line, const std::string& headers = "Host: cell7\r\n") {
  return ParseRequest(line + "\r\n" + headers + "\r\n");
}

int Refusal(const std::string& line, const std::string& headers = "Host: cell7\r\n") {
  return Parsed(line, headers).refusal;
}

}  // namespace

TEST_CASE("path, parameters and headers are parsed") {
  const ParsedRequest parsed =
      Parsed("GET /reports/a%2Db.html?token=a+b%26c&empty=&&flag#part HTTP/1.1",
             "HOST:  cell7:8080 \r\nCookie: a=b; c=d\r\nX-Empty:\r\nhost: other\r\n");
  REQUIRE(parsed.refusal == 0);
  const HttpRequest& request = parsed.request;
  CHECK(request.method == "GET");
  CHECK(request.path == "/reports/a-b.html");
  CHECK(request.Parameter("token") == "a b&c");
  CHECK(request.Parameter("empty") == "");
  CHECK(request.Parameter("flag") == "");
  CHECK_FALSE(request.Parameter("none"));
  CHECK(request.Header("host") == "cell7:8080");
  CHECK(request.HeaderCount("host") == 2);
  CHECK(request.Header("cookie") == "a=b; c=d");
  CHECK(request.Header("x-empty").empty());
  CHECK(request.host.empty());  // two of them
  CHECK(Parsed("GET /a/../b/./c//d HTTP/1.1").request.path == "/a/../b/./c//d");
  CHECK(ParseRequest("GET / HTTP/1.1\nHost: cell7\n\n").request.host == "cell7");
}

TEST_CASE("the host of an absolute target replaces the Host header") {
  const HttpRequest request = Parsed("GET HTTP://other:80/status.json?x=1 HTTP/1.0").request;
  CHECK(request.host == "other:80");
  CHECK(request.path == "/status.json");
  CHECK(request.Parameter("x") == "1");
  CHECK(Parsed("GET http://other HTTP/1.1").request.path == "/");
  CHECK(Parsed("GET http://other HTTP/1.1").request.host == "other");
  CHECK(Parsed("GET / HTTP/1.1").request.host == "cell7");
  CHECK(Refusal("GET http:///status.json HTTP/1.1") == 400);
  CHECK(Refusal("GET https://cell7/ HTTP/1.1") == 400);
}

TEST_CASE("for unsupported methods only the method is parsed") {
  for (const char* line :
       {"POST / HTTP/1.1", "OPTIONS * HTTP/1.1", "CONNECT cell7:80 HTTP/1.1", "get / HTTP/1.1"}) {
    CAPTURE(line);
    const ParsedRequest parsed = Parsed(line, "Content-Length: 5\r\nbroken\r\n");
    CHECK(parsed.refusal == 0);
    CHECK(parsed.request.method == std::string(line, std::string(line).find(' ')));
    CHECK(parsed.request.headers.empty());
  }
}

TEST_CASE("malformed requests are refused") {
  for (const char* line :
       {"", "GET", "GET /", "GET  / HTTP/1.1", "GET / HTTP/1.1 x", "G(T / HTTP/1.1", " / HTTP/1.1",
        "GET status.json HTTP/1.1", "GET /%zz HTTP/1.1", "GET /%4 HTTP/1.1", "GET /a%00b HTTP/1.1",
        "GET /?a=%0d%0aSet-Cookie:x HTTP/1.1", "GET * HTTP/1.1", "GET / FTP/1.1"}) {
    CAPTURE(line);
    CHECK((Refusal(line) == 400 || Refusal(line) == 505));
  }
  CHECK(Refusal("GET / HTTP/2.0") == 505);
  CHECK(Refusal(std::string("GET /a\0b HTTP/1.1", 17)) == 400);
  CHECK(Refusal("GET / HTTP/1.1", "no colon\r\n") == 400);
  CHECK(Refusal("GET / HTTP/1.1", ": no name\r\n") == 400);
  CHECK(Refusal("GET / HTTP/1.1", "Host : cell7\r\n") == 400);
  CHECK(Refusal("GET / HTTP/1.1", "Host: cell7\r\n folded\r\n") == 400);
  CHECK(Refusal("GET / HTTP/1.1", "X: a\rb\r\n") == 400);
  CHECK(Refusal("GET / HTTP/1.1", std::string("X: a\0b\r\n", 8)) == 400);
  CHECK(Refusal("GET / HTTP/1.1", "Content-Length: 0\r\n") == 0);
  for (const char* body : {"Content-Length: 5\r\n", "Content-Length: 0\r\nContent-Length: 5\r\n",
                           "Content-Length: -1\r\n", "Transfer-Encoding: chunked\r\n"}) {
    CAPTURE(body);
    CHECK(Refusal("GET / HTTP/1.1", body) == 413);
    CHECK(Parsed("HEAD / HTTP/1.1", body).request.method == "HEAD");
  }
}

TEST_CASE("too many headers are refused") {
  std::string headers;
  for (std::size_t k = 0; k < kMaxHeaders; ++k) headers += "A:b\r\n";
  CHECK(Refusal("GET / HTTP/1.1", headers) == 0);
  CHECK(Refusal("GET / HTTP/1.1", headers + "A:b\r\n") == 431);
}

TEST_CASE("the end of a head is found at its blank line, however the bytes arrive") {
  const std::string request = "GET / HTTP/1.1\r\nHost: a\r\n\r\nGET /next";
  const std::size_t end = request.find("GET /next");
  CHECK(EndOfHead(request) == end);
  for (std::size_t seen = 0; seen < end; ++seen) {
    CHECK_FALSE(EndOfHead(request.substr(0, seen)));
    CHECK(EndOfHead(request, seen) == end);
  }
  CHECK(EndOfHead("GET / HTTP/1.1\n\n") == 16U);
  CHECK_FALSE(EndOfHead(""));
}

TEST_CASE("a response has unique headers, and a length unless it is a stream") {
  HttpResponse response;
  response.Set("X-A", "1");
  response.Set("X-A", "2");
  response.SetBody("four", "text/plain");
  CHECK(HeadOf(response) ==
        "HTTP/1.1 200 OK\r\nConnection: close\r\nX-A: 2\r\nContent-Type: text/plain\r\n"
        "Content-Length: 4\r\n\r\n");
  response.stream = [](const HttpWrite&) { return false; };
  CHECK(HeadOf(response).find("Content-Length") == std::string::npos);
}

}  // namespace plumbline::http_message_test
