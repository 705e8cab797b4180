#include "app/log/catalogue_parts.h"

namespace plumbline {
namespace {

constexpr EventEntry kFleetEntries[] = {
    // fleet
    {Event::kFleetStarted, "fleet-started", LogLevel::kNotice, "70e7b5378adce99209db8c729894c709",
     "fleet", "plumbline-fleet ..., N messages wait",
     "what the plant is told goes through its queue from now on", ""},
    {Event::kFleetNotStarted, "fleet-not-started", LogLevel::kError,
     "c43f40e694d7a985725b81df6ca67f5e", "fleet", "not started: ...",
     "faults stand above it, there is no `[mqtt]`, or the queue cannot be used",
     "what it says; `plumbline check` tells the same; a queue that is damaged: move "
     "`fleet/queue.sqlite` of the state directory away"},
    {Event::kBrokerUp, "broker-up", LogLevel::kNotice, "c46de5d401fb440f308e1d4d227ddfa0", "fleet",
     "broker ... has the connection, N messages wait", "what waited is sent now, the oldest first",
     ""},
    {Event::kBrokerLost, "broker-lost", LogLevel::kWarning, "95b658041dbf22498d58edc38bfade75",
     "fleet", "broker ...: ...; messages are kept meanwhile",
     "no connection, and why; nothing is lost until the queue is full",
     "`plumbline doctor` tells the same; network, host, port; not authorised: username and "
     "password file; TLS: `tls_ca`, and the host as the broker's certificate names it"},
    {Event::kFleetForwarded, "fleet-forwarded", LogLevel::kNotice,
     "63918c0d0205330210f199ff89a00937", "fleet", "N messages forwarded in ... s",
     "what had waited is with the broker", ""},
    {Event::kFleetDropping, "fleet-dropping", LogLevel::kWarning,
     "dce4c8ec115aa3597c190b0b43fc4530", "fleet", "queue is full ...",
     "the broker is away for longer than `queue_mb` lasts",
     "bring it back; or a larger `queue_mb`, a longer `state_s`"},
    {Event::kFleetDropped, "fleet-dropped", LogLevel::kWarning, "6fa3b5ae4dfa800877ae4e86ed7f714f",
     "fleet", "dropped since the queue was made: ...",
     "so many messages never reach the plant; its consumers are told the same",
     "probes stand in the journal: `plumbline journal export`"},
    {Event::kFleetQueueFault, "fleet-queue-fault", LogLevel::kError,
     "9a7903677ed4360cc1a5908e109cbc2f", "fleet", "queue: ...",
     "states are not kept until it works; alarms, points, models and lenses wait in memory, "
     "10000 at most, and are told late; what waits is forgotten where the publisher is restarted; "
     "probes stay in the journal and are told late",
     "disk full, permissions of `fleet` in the state directory"},
    {Event::kFleetQueueWorks, "fleet-queue-works", LogLevel::kNotice,
     "b9f263cd703bdaa7ee5b888dc443e622", "fleet",
     "queue works again; N messages are told late, N were forgotten", "", ""},
    {Event::kFleetJournal, "fleet-journal", LogLevel::kWarning, "f6963626370b361e4fb9d55a9667766e",
     "fleet", "probes are not published: ...",
     "the measurement journal cannot be read; they are told when it can",
     "what it says; most often the daemon has not run since an upgrade"},
    {Event::kFleetFeedLost, "feed-lost", LogLevel::kWarning, "5012b2553f3530c3588b711e6b1c9081",
     "fleet", "... (view.socket)",
     "the daemon does not run, or may not be looked at; after 5 s the plant is told",
     "`systemctl status plumbline`"},
    {Event::kFleetFeedBack, "feed-back", LogLevel::kNotice, "4c47ec67edd30fa4923ae2ff2418bed5",
     "fleet", "receiving data from plumblined again", "", ""},
};

}  // namespace

std::span<const EventEntry> FleetEvents() {
  return kFleetEntries;
}

}  // namespace plumbline
