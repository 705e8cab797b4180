#include "app/base/log/catalogue_parts.h"

namespace plumbline::log {
namespace {

constexpr EventEntry kSparkplugEntries[] = {
    // sparkplug
    {Event::kSparkplugStarted, "sparkplug-started", LogLevel::kNotice,
     "f03131ebf699463994ff1071db3e8d38", "sparkplug", "plumbline-sparkplug ..., up to N edge nodes",
     "", ""},
    {Event::kSparkplugNotStarted, "sparkplug-not-started", LogLevel::kError,
     "ee9c504993634b178563678d575e5aa4", "sparkplug", "... has the faults logged above ...",
     "the bridge does not start; if it runs, it keeps the configuration that it has",
     "fix the reported lines of `plant.toml`"},
    {Event::kSparkplugCellsUp, "sparkplug-cells-up", LogLevel::kNotice,
     "ab57936e4e3748769eba5315e3006609", "sparkplug", "cells' broker ... connected", "", ""},
    {Event::kSparkplugCellsLost, "sparkplug-cells-lost", LogLevel::kWarning,
     "c094f02c2a04437dbe70b69581f2396d", "sparkplug", "cells' broker ...: ...",
     "whether the cells are online is unknown; after 10 s all edge nodes are reported dead",
     "check network, host and port of `[broker]`. Not authorised: username and password file. TLS: "
     "`tls_ca`, and the host name as in the broker's certificate"},
    {Event::kSparkplugHostsUp, "sparkplug-hosts-up", LogLevel::kNotice,
     "1f8bd4f5f0334a2099b7dc6bbc1e50eb", "sparkplug",
     "Sparkplug broker ...: all N edge nodes are connected again", "", ""},
    {Event::kSparkplugHostsLost, "sparkplug-hosts-lost", LogLevel::kWarning,
     "0315edfd6e6149a98424944293f7b872", "sparkplug", "Sparkplug broker ...: ... (edge node ...)",
     "edge nodes have no connection to the hosts' broker; they connect again by themselves, with "
     "the newest values. What changed meanwhile is not repeated",
     "check the broker named by the line, its limit on connections, and the bridge's rights"},
    {Event::kSparkplugUnreadable, "sparkplug-unreadable", LogLevel::kWarning,
     "92be3ba265234609bc21ad8730b5c7df", "sparkplug", "message ... not understood: ...",
     "the message is ignored; its metrics keep their values",
     "another program publishes under `plumblineV1`, or the cell is newer than the bridge: update "
     "it"},
    {Event::kSparkplugMissed, "sparkplug-missed", LogLevel::kWarning,
     "e247c93e1bc24264ac856a60c7fb77c8", "sparkplug",
     "cell ...: messages before number N are missing; ...",
     "the broker, or the cell's full queue, dropped messages. Points have quality 500 until the "
     "cell reports them again",
     "let the broker keep more for the bridge's session: `max_queued_messages`"},
    {Event::kSparkplugTooMany, "sparkplug-too-many", LogLevel::kWarning,
     "278bf3e6c74141a5b67519dee45184cc", "sparkplug", "cell ... has no edge node: ...",
     "as many cells as `max_nodes` allows, or 500000 metrics, are presented",
     "raise `max_nodes`; or run another bridge at another broker"},
    {Event::kSparkplugCommand, "sparkplug-command", LogLevel::kNotice,
     "352d3af23d4643bd8dc0168afd24ca07", "sparkplug", "command to ... ignored: ...",
     "a host tried to write a metric; only `Node Control/Rebirth` can be written", ""},
    {Event::kSparkplugPoints, "sparkplug-points", LogLevel::kWarning,
     "8c40c265e3184d968604030a7377f195", "sparkplug", "... points ...",
     "the file that keeps the points across a restart of the bridge cannot be read or written; "
     "points are null after a restart until the cells report them",
     "as the line says; a damaged `points.json` may be deleted"},
};

}  // namespace

std::span<const EventEntry> SparkplugEvents() {
  return kSparkplugEntries;
}

}  // namespace plumbline::log
