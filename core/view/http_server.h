/// HTTP on 127.0.0.1, for pages of this program alone: requests without the token, or from another site, are
/// refused.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace crt {

struct HttpRequest {
    std::string method;
    std::string path;  ///< "/pixel"
    std::map<std::string, std::string> query;
    std::string body;
};

struct HttpReply {
    unsigned status = 200;
    std::string type = "text/plain; charset=utf-8";
    std::string body{};
    std::map<std::string, std::string> headers{};
};

/// Random letters and digits.
std::string randomToken();

/// Reason why a request is refused; empty if it is accepted. `host` and `origin` are its headers, the latter
/// empty where there is none. A page of another site that a browser shows can send requests here, and a
/// domain name that points to 127.0.0.1 gives such a page the same origin (DNS rebinding): hence both are
/// checked.
std::string refusal(std::uint16_t port, const std::string& host, const std::string& origin,
                    const std::string& token, const std::string& given_token);

class HttpServer {
public:
    /// `port` 0: any that is free. `answer` is called on many threads at once, and may take its time. Throws
    /// crt::Error(Usage) for a port that is taken.
    HttpServer(std::uint16_t port, std::string token, std::function<HttpReply(const HttpRequest&)> answer);
    /// Closes all connections and waits until every answer() has returned.
    ~HttpServer();
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;

    std::uint16_t port() const { return port_; }

private:
    struct Listening;
    class Connection;
    /// A connection that has sent nothing yet: it has a descriptor, and no thread.
    struct Silent {
        int descriptor = -1;
        std::chrono::steady_clock::time_point until{};
    };

    bool isStopping();
    void accept();
    /// Waits for a connection, data or a timeout, and handles it.
    void acceptSome();
    int pollTime() const;
    void serveThoseWhoSpeak();
    void takeNew();
    /// Serves it on a separate thread, which owns the descriptor. False: there is no room for a thread.
    bool start(Silent& silent);
    /// Interrupts the oldest connection that has shown no token, where there are too many, and waits a
    /// moment until one is closed.
    void makeRoom(std::unique_lock<std::mutex>& lock);
    void close(Connection* connection);
    void serve(Connection& connection);
    HttpReply replyTo(const HttpRequest& request);

    const std::string token_;
    const std::function<HttpReply(const HttpRequest&)> answer_;
    std::unique_ptr<Listening> listening_;
    std::uint16_t port_ = 0;
    std::mutex mutex_;
    std::condition_variable closed_;
    std::list<Connection*> open_;  ///< Those with threads, the oldest first.
    bool stopping_ = false;
    std::deque<Silent> silent_;  ///< Of the accepting thread; the oldest first.
    std::thread thread_;
};

}  // namespace crt
