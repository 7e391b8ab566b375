"""What libraries give for the same task, to be shown beside ours. Baselines: nothing in the product uses them."""
