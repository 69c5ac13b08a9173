"""Source that `vsctrl.derive.emit` prints; a test holds it to the derivation."""
