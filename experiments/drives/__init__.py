"""Virtual drives of foreign physics, and how near identification comes to them."""
