// Sends the token in a header, so that it does not appear in an address. Without scripts the form
// sends it in the address.
"use strict";

const form = document.getElementById("form");

// When a link from another site leads here, the browser withholds the cookie; this request sends it.
fetch("status.json").then((answer) => { if (answer.ok) location.reload(); }).catch(() => {});

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  const said = document.getElementById("said");
  try {
    const token = document.getElementById("token").value;
    const answer = await fetch("login",
      {headers: {Authorization: "Bearer " + token}, redirect: "manual"});
    if (answer.type === "opaqueredirect") location.replace("/");
    else said.textContent = "Wrong token.";
  } catch (error) {
    said.textContent = "The server of the page does not respond.";
  }
});
