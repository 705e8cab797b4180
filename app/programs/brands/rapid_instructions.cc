// Names and arguments: ABB, Technical reference manual - RAPID Instructions, Functions and Data
// types, and the manuals of the options Arc, Spot, Paint, Dispense, Force Control and EGM.
#include "app/programs/brands/rapid_instructions.h"

#include <algorithm>
#include <string>

namespace plumbline::programs::rapid {

namespace {

constexpr MotionKind kJ = MotionKind::kJoint;
constexpr MotionKind kL = MotionKind::kLinear;
constexpr MotionKind kC = MotionKind::kCircular;
constexpr std::string_view kSearch = "a search ends where the signal changes";
constexpr std::string_view kGuided = "a sensor guides the motion";
constexpr std::string_view kForce = "the contact force guides the motion";

constexpr MotionInstruction kMotions[] = {
    {"movej", kJ},
    {"movel", kL},
    {"movec", kC, 0, 4},
    {"moveabsj", kJ},
    {"movejao", kJ},
    {"movejdo", kJ},
    {"movejgo", kJ},
    {"movejsync", kJ, 0, 3, "", true},
    {"movelao", kL},
    {"moveldo", kL},
    {"movelgo", kL},
    {"movelsync", kL, 0, 3, "", true},
    {"movecao", kC, 0, 4},
    {"movecdo", kC, 0, 4},
    {"movecgo", kC, 0, 4},
    {"movecsync", kC, 0, 4, "", true},
    {"triggj", kJ, 0, 4},
    {"triggabsj", kJ, 0, 4},
    {"triggjios", kJ},
    {"triggl", kL, 0, 4},
    {"trigglios", kL},
    {"triggc", kC, 0, 5},
    {"arcl", kL, 0, -1},
    {"arclstart", kL, 0, -1},
    {"arclend", kL, 0, -1},
    {"arcl1", kL, 0, -1},
    {"arcl2", kL, 0, -1},
    {"arcl1start", kL, 0, -1},
    {"arcl1end", kL, 0, -1},
    {"arcl2start", kL, 0, -1},
    {"arcl2end", kL, 0, -1},
    {"arcc", kC, 0, -1},
    {"arccstart", kC, 0, -1},
    {"arccend", kC, 0, -1},
    {"arcc1", kC, 0, -1},
    {"arcc2", kC, 0, -1},
    {"arccalcl", kL, 0, -1},
    {"arcmovej", kJ},
    {"arcmovel", kL},
    {"arcmovec", kC, 0, 4},
    {"arcmoveabsj", kJ},
    {"spotl", kL, 0, -1},
    {"spotj", kJ, 0, -1},
    {"spotml", kL, 0, -1},
    {"spotmj", kJ, 0, -1},
    {"nutl", kL, 0, -1},
    {"nutj", kJ, 0, -1},
    {"displ", kL, 0, -1},
    {"dispc", kC, 0, -1},
    {"paintl", kL},
    {"paintc", kC, 0, 4},
    {"capl", kL, 0, -1},
    {"capc", kC, 0, -1},
    {"searchl", kL, 2, 4, kSearch},
    {"searchc", kC, 2, 5, kSearch},
    {"egmmovel", kL, 1, -1, kGuided},
    {"egmmovec", kC, 1, -1, kGuided},
    {"fcpress1lstart", kL, 0, -1, kForce},
    {"fcpressl", kL, 0, -1, kForce},
    {"fcpressc", kC, 0, -1, kForce},
    {"fcpressend", kL, 0, -1, kForce},
};

/// Sorted; a blank around each.
constexpr std::string_view kStay =
    " accset acteventbuffer actunit add alarmsetup aliasio aliasioreset bitclear bitset "
    "bookerrno break camflush camgetparameter camgetresult camloadjob camreqimage "
    "camsetexposure camsetparameter camsetprogrammode camsetrunmode camstartloadjob "
    "camwaitloadjob circpathmode cirpathmode clear cleariobuff clearpath clearrawbytes "
    "clkreset clkstart clkstop close closedir collisionfree confj confl copyfile "
    "copyrawbytes cornerpathwarning corrclear corrcon corrdiscon corrwrite deacteventbuffer "
    "deactunit decr ditheract ditherdeact dropsensor dropwobj egmactjoint egmactmove "
    "egmactpose egmgetid egmreset egmsetupai egmsetupao egmsetupgi egmsetupltapp egmsetupuc "
    "egmstreamstart egmstreamstop eoffsoff eoffson eoffsset erasemodule errlog errraise "
    "errwrite fitcircle fricidevaluate fricidinit fricidsetfricparams getdataval "
    "getjointdata getsysdata gettorquemargin gettrapdata gripload hollowwristreset idelete "
    "idisable ienable ierror incr indreset invertdo iobusstart iobusstate iodisable ioenable "
    "ipathpos ipers irmqmessage isignalai isignalao isignaldi isignaldo isignalgi isignalgo "
    "isleep itimer ivarvalue iwatch load loadid makedir manloadidproc mechunitload "
    "motionprocessmodeset motionsup moveextj mtoolrotcalib mtooltcpcalib open opendir "
    "packdnheader packrawbytes pathacclim pathlengthreset pathlengthstart pathlengthstop "
    "pathrecstart pathrecstop pathresol pdispoff pdispon pdispset procerrrecovery pulsedo "
    "readanybin readblock readcfgdata readerrdata readrawbytes readvararr "
    "removeallcyclicbool removecyclicbool removedir removefile removesuperv renamefile reset "
    "resetaxisdistance resetaxismovetime resetppmoved resetretrycount resettorquemargin "
    "restopath rewind rmqemptyqueue rmqfindslot rmqgetmessage rmqgetmsgdata rmqgetmsgheader "
    "rmqreadwait rmqsendmessage rmqsendwait safetycontrollersyncrequest save scwrite "
    "sendevice set setalldataval setao setdatasearch setdataval setdo setgo setsysdata "
    "setupcyclicbool setupsuperv siclose siconnect sigetcyclic singarea sisetcyclic skipwarn "
    "socketaccept socketbind socketclose socketconnect socketcreate socketlisten "
    "socketreceive socketreceivefrom socketsend socketsendto softact softdeact speedlimaxis "
    "speedlimcheckpoint speedrefresh spystart spystop startload startmove startmoveretry "
    "stcalib stclose stindgun stindgunreset stop stopen stopmove stopmovereset storepath "
    "sttuneforce supsyncsensoroff supsyncsensoron syncmoveoff syncmoveon syncmoveresume "
    "syncmovesuspend syncmoveundo synctosensor systemstopaction testsigndefine testsignreset "
    "texttabinstall tperase tpreaddnum tpreadfk tpreadnum tpshow tpwrite triggcheckio "
    "triggdatacopy triggdatareset triggequip triggint triggio triggrampao triggspeed "
    "triggstopproc tryint tunereset tuneservo uimessagebox uimsgbox uimsgwrite "
    "uimsgwriteabort uishow unload unpackrawbytes velset waitai waitao waitdi waitdo waitgi "
    "waitgo waitload waitrob waitsensor waitsynctask waittestandset waittime waituntil "
    "waitwobj worldacclim write writeanybin writebin writeblock writecfgdata writerawbytes "
    "writestrbin writevar writevararr wzboxdef wzcyldef wzdisable wzdoset wzdosets wzenable "
    "wzfree wzhomejointdef wzlimjointdef wzlimsup wzsphdef ";

}  // namespace

const MotionInstruction* FindMotion(std::string_view name) {
  const auto found = std::find_if(std::begin(kMotions), std::end(kMotions),
                                  [&](const MotionInstruction& one) { return one.name == name; });
  return found == std::end(kMotions) ? nullptr : found;
}

const Shift* FindShift(std::string_view name, std::string_view Shift::*side) {
  const auto found = std::ranges::find(kShifts, name, side);
  return found == kShifts.end() ? nullptr : &*found;
}

bool StaysInPlace(std::string_view name) {
  return kStay.find(" " + std::string(name) + " ") != std::string_view::npos;
}

bool ChangesArguments(std::string_view name) {
  return name == "loadid" || name == "mtooltcpcalib" || name == "mtoolrotcalib";
}

}  // namespace plumbline::programs::rapid
