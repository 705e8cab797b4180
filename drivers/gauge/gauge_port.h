// Interface of the connection over which a dial gauge sends its text.
#pragma once

#include <string>

namespace plumbline::gauge {

/// Not thread-safe. Does not reconnect by itself.
class GaugePort {
 public:
  GaugePort() = default;
  virtual ~GaugePort() = default;
  GaugePort(const GaugePort&) = delete;
  GaugePort& operator=(const GaugePort&) = delete;

  /// @return  false if it cannot be opened; see problem()
  virtual bool Open() = 0;
  virtual void Close() = 0;
  virtual bool is_open() const = 0;
  /// Waits up to `timeout_s` for data and appends them to `text`. Requires an open port.
  /// @return  false if the connection was lost; see problem()
  virtual bool Receive(double timeout_s, std::string& text) = 0;

  /// Device, as messages name it.
  virtual std::string name() const = 0;
  /// What to check if the data are not of the configured format.
  virtual std::string settings_to_check() const = 0;
  /// Why Open() or Receive() failed, with the remedy.
  const std::string& problem() const { return problem_; }

 protected:
  std::string problem_;
};

}  // namespace plumbline::gauge
