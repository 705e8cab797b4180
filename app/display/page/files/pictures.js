// Browser of the alarm pictures, in a dialog.
"use strict";

const alarmPictures = {list: [], shown: 0};

function showAlarmPicture(index) {
  const {list} = alarmPictures;
  if (index < 0 || index >= list.length) return;
  alarmPictures.shown = index;
  const {name, words} = list[index];
  const picture = document.getElementById("viewer-picture");
  picture.src = "reports/" + encodeURIComponent(name);
  picture.alt = words;
  document.getElementById("viewer-title").textContent = words + ", " + (index + 1) + " of " + list.length;
  document.getElementById("viewer-newer").disabled = index === 0;
  document.getElementById("viewer-older").disabled = index === list.length - 1;
  const viewer = document.getElementById("viewer");
  if (!viewer.open) viewer.showModal();
}

// The pictures, newest first: [{name, words}].
function setAlarmPictures(list) {
  alarmPictures.list = list;
}

document.getElementById("viewer-newer").addEventListener("click", () => showAlarmPicture(alarmPictures.shown - 1));
document.getElementById("viewer-older").addEventListener("click", () => showAlarmPicture(alarmPictures.shown + 1));
document.getElementById("viewer-close").addEventListener("click", () => document.getElementById("viewer").close());
document.getElementById("viewer").addEventListener("keydown", (event) => {
  if (event.key === "ArrowLeft") showAlarmPicture(alarmPictures.shown + 1);
  if (event.key === "ArrowRight") showAlarmPicture(alarmPictures.shown - 1);
});
