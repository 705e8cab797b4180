// Hands the token over in a header, so that it stands in no address. Without script the form does.
"use strict";

const form = document.getElementById("form");

// A link from another site comes without the cookie, though there is one: from here it goes along.
fetch("status.json").then((answer) => { if (answer.ok) location.reload(); }).catch(() => {});

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  const said = document.getElementById("said");
  try {
    const token = document.getElementById("token").value;
    const answer = await fetch("login",
      {headers: {Authorization: "Bearer " + token}, redirect: "manual"});
    if (answer.type === "opaqueredirect") location.replace("/");
    else said.textContent = "That is not the token.";
  } catch (error) {
    said.textContent = "plumbline-view does not answer.";
  }
});
