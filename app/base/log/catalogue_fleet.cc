#include "app/base/log/catalogue_parts.h"

namespace plumbline::log {
namespace {

constexpr EventEntry kFleetEntries[] = {
    // fleet
    {Event::kFleetStarted, "fleet-started", LogLevel::kNotice, "70e7b5378adce99209db8c729894c709",
     "fleet", "plumbline-fleet ..., N messages queued",
     "messages to the plant go through its queue from now on", ""},
    {Event::kFleetNotStarted, "fleet-not-started", LogLevel::kError,
     "c43f40e694d7a985725b81df6ca67f5e", "fleet", "not started: ...",
     "the configuration has the faults logged before this line, there is no `[mqtt]`, or the queue "
     "cannot be used",
     "fix what the line names; run `plumbline check` to verify. Damaged queue: move "
     "`fleet/queue.sqlite` out of the state directory"},
    {Event::kBrokerUp, "broker-up", LogLevel::kNotice, "c46de5d401fb440f308e1d4d227ddfa0", "fleet",
     "broker ... connected, N messages queued", "queued messages are sent now, oldest first", ""},
    {Event::kBrokerLost, "broker-lost", LogLevel::kWarning, "95b658041dbf22498d58edc38bfade75",
     "fleet", "broker ...: ...; messages are queued meanwhile",
     "not connected; the line says why. Nothing is lost until the queue is full",
     "run `plumbline doctor`; check network, host and port. Not authorised: username and password "
     "file. TLS: `tls_ca`, and the host name as in the broker's certificate"},
    {Event::kBrokerIntruded, "broker-intruded", LogLevel::kWarning,
     "e8aec99834e4435fbfe18dc0173aabdd", "fleet",
     "broker ... sent a message, or a packet for which there is no memory",
     "a publisher subscribes to nothing, so no broker sends it messages: this one is faulty or not "
     "the plant's. It is tried again every minute",
     "check `host` and the broker's log; use `tls_ca`, so that only the plant's broker is "
     "accepted"},
    {Event::kFleetForwarded, "fleet-forwarded", LogLevel::kNotice,
     "63918c0d0205330210f199ff89a00937", "fleet", "N messages forwarded in ... s",
     "the queued messages have been delivered to the broker", ""},
    {Event::kFleetDropping, "fleet-dropping", LogLevel::kWarning,
     "dce4c8ec115aa3597c190b0b43fc4530", "fleet", "queue is full ...",
     "the broker has been away for longer than `queue_mb` lasts",
     "restore the broker; or use a larger `queue_mb`, a longer `state_s`"},
    {Event::kFleetDropped, "fleet-dropped", LogLevel::kWarning, "6fa3b5ae4dfa800877ae4e86ed7f714f",
     "fleet", "dropped since the queue was created: ...",
     "that many messages never reach the plant; its consumers are informed",
     "probes are still in the journal: `plumbline journal export`"},
    {Event::kFleetQueueFault, "fleet-queue-fault", LogLevel::kError,
     "9a7903677ed4360cc1a5908e109cbc2f", "fleet", "queue: ...",
     "states are not stored until the queue works; alarms, points, models and lenses wait in "
     "memory, at most 10000, and are published late; they are lost if the publisher is restarted; "
     "probes stay in the journal and are published late",
     "disk full, permissions of `fleet` in the state directory"},
    {Event::kFleetQueueWorks, "fleet-queue-works", LogLevel::kNotice,
     "b9f263cd703bdaa7ee5b888dc443e622", "fleet",
     "queue works again; N messages are published late, N were discarded", "", ""},
    {Event::kFleetJournal, "fleet-journal", LogLevel::kWarning, "f6963626370b361e4fb9d55a9667766e",
     "fleet", "probes are not published: ...",
     "the measurement journal cannot be read; probes are published once it can",
     "as the line says; usually the daemon has not run since an upgrade"},
    {Event::kFleetCell, "fleet-cell", LogLevel::kWarning, "e1f29eb314204e1da5e5ce9c5a8a20ac",
     "fleet", "the cell is not published: ...",
     "the file of the model in force cannot be read; the plant keeps the cell it had",
     "as the line says; usually permissions of the cell file or of `models` in the state "
     "directory"},
    {Event::kFleetFeedLost, "feed-lost", LogLevel::kWarning, "5012b2553f3530c3588b711e6b1c9081",
     "fleet", "... (view.socket)",
     "the daemon is not running, or denies access; the plant is informed after 5 s",
     "`systemctl status plumbline`"},
    {Event::kFleetFeedBack, "feed-back", LogLevel::kNotice, "4c47ec67edd30fa4923ae2ff2418bed5",
     "fleet", "receiving data from plumblined again", "", ""},
};

}  // namespace

std::span<const EventEntry> FleetEvents() {
  return kFleetEntries;
}

}  // namespace plumbline::log
