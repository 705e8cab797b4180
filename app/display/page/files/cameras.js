// Commissioning: the cameras of this computer, and the command that selects one of them.
"use strict";

function cameraOption(camera, used) {
  const item = element("li"), label = element("label"), radio = element("input");
  radio.type = "radio";
  radio.name = "camera";
  radio.addEventListener("change", () => showChoice(camera));
  label.append(radio, " " + (camera.name || "camera") + ", " + camera.select +
    (camera.select === camera.device ? "" : ", " + camera.device) + (used ? " (in use)" : ""));
  item.append(label);
  return item;
}

function showChoice(camera) {
  byId("choice").hidden = false;
  byId("choice-command").textContent = camera.command || "plumbline cameras";
  byId("choice-words").textContent = camera.command ?
    "On this computer, this command prints the lines of plumbline.toml that select the camera:" :
    "The camera's name contains characters that a shell interprets. On this computer, find the camera's " +
    "number with this command, then add --choose and the number:";
  byId("choice-copied").textContent = "";
}

function showCameras(cameras) {
  const names = ((status && status.cameras) || []).map((camera) => camera.serial);
  const isUsed = (camera) => [camera.select, camera.serial].some((name) => name && names.includes(name));
  put(byId("cameras"), [cameras, names], (target) => {
    byId("choice").hidden = true;
    target.replaceChildren(...cameras.map((camera) => cameraOption(camera, isUsed(camera))));
    if (cameras.length === 0) {
      target.replaceChildren(element("li", "none connected; connect one and open this list again", "faded"));
    }
  });
}

// The browser offers the clipboard on this computer and over TLS only; elsewhere the command is selected.
async function copyCommand() {
  const command = byId("choice-command");
  try {
    await navigator.clipboard.writeText(command.textContent);
    byId("choice-copied").textContent = "copied";
  } catch (error) {
    getSelection().selectAllChildren(command);
    byId("choice-copied").textContent = "selected: copy it with Ctrl+C";
  }
}

byId("choice-copy").addEventListener("click", copyCommand);
byId("commissioning").addEventListener("toggle", async () => {
  if (!byId("commissioning").open) return;
  const answer = await ask("cameras.json");
  if (answer) showCameras(answer.cameras);
});
