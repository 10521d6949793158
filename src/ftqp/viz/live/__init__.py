"""Moving pictures of an arm: frames, and the page that shows them."""
